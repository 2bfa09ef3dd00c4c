#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Cold clouds that collide: the same on 1 and 2 threads, on two and three ranks and after a restart; books that close.
. "$TEPHRA_SOURCE/tests/lib.sh"
scene=$TEPHRA_SOURCE/ics/cloud_box.yml
small="--set start.n=500 --set time.end=100Myr"
last() { awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); if ($i == name) at = i } } END { print $at }' "$1"; }

expect_status 0 tephra run "$scene" $small --threads 1 --out one
expect_status 0 tephra run "$scene" $small --threads 2 --out two
same one/snapshot_004.hdf5 two/snapshot_004.hdf5
expect_status 0 tephra run "$scene" $small --set time.end=50Myr --out half
expect_status 0 tephra run --restart half --set time.end=100Myr
same one/snapshot_004.hdf5 half/snapshot_004.hdf5
cmp -s one/budget.csv half/budget.csv || fail "budget.csv differs after a restart"
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    for ranks in 2 3; do
        expect_status 0 mpirun -n $ranks --oversubscribe tephra run "$scene" $small --threads 1 --out ranks$ranks
        same one/snapshot_004.hdf5 ranks$ranks/snapshot_004.hdf5
    done
fi
awk -v n="$(last one/budget.csv cloud_coagulations)" 'BEGIN { exit !(n > 5) }' || fail "no clouds became one"
awk -v e="$(last one/energy.csv error)" 'BEGIN { exit !(e < 1e-13 && e > -1e-13) }' || fail "energy: $(last one/energy.csv error)"
tephra info one/snapshot_004.hdf5 >info
grep -q "^cloud: $(last one/budget.csv clouds) rows" info || fail "the snapshot holds clouds that are no more: $(grep cloud info)"

# Viscosity instead: slower loss, books that close.
expect_status 0 tephra run "$scene" $small --set clouds.variant=viscous --out viscous
awk -v e="$(last viscous/energy.csv error)" -v r="$(last viscous/energy.csv radiated_clouds)" \
    'BEGIN { exit !(e < 1e-13 && e > -1e-13 && r > 0.001) }' || fail "viscous: $(tail -n 1 viscous/energy.csv)"

# Under gravity: clouds at rest fall together, become one another and heaps at the mass limit.
expect_status 0 tephra run "$scene" --set start.n=800 --set start.dispersion=0 --set box.x=0.8 --set box.y=0.8 --set box.z=0.8 \
    --set time.end=0.01Myr --out rest
cat >heap.yml <<END
units: {length: kpc, mass: 1e10 Msun, velocity: km/s}
start: {file: rest/snapshot_000.hdf5}
time: {end: 50 Myr}
output: {snapshot_every: 50 Myr}
gravity: {softening: 10 pc}
clouds: {}
END
expect_status 0 tephra run heap.yml --out heap
awk -v n="$(last heap/budget.csv cloud_coagulations)" 'BEGIN { exit !(n > 500) }' || fail "the heap: $(tail -n 1 heap/budget.csv)"
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "error") at = i }
    NR > 1 && ($at > 0.005 || $at < -0.005) { exit bad = 1 } END { exit bad }' heap/energy.csv || fail "energy of a heap of clouds"

# Heaps that do not coagulate bounce endlessly, unless clouds rest after a bounce.
expect_status 0 tephra run heap.yml --set clouds.coagulation=never --set clouds.rest=1 --out rests
awk -v n="$(last rests/budget.csv cloud_collisions)" 'BEGIN { exit !(n > 1000 && n < 20000) }' || fail "heap that rests: $(tail -n 1 rests/budget.csv)"

# Said and refused.
expect_status 0 tephra check "$scene" --set "box.x=500 pc" --set "box.y=500 pc" --set "box.z=500 pc"
expect_text 'clouds fill' err
expect_status 2 tephra check "$scene" --set clouds.restitution=2
expect_text 'restitution' err
finish
