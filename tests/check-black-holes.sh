#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Black holes in whole runs: binaries.csv against Kepler's orbit, the same bits on threads, ranks and after a restart,
# files, and what is refused.
. "$TEPHRA_SOURCE/tests/lib.sh"
scene=$TEPHRA_SOURCE/ics/cluster_bh.yml

# Two holes and a few stars without weight: half of the circular speed at the distance d = 2 of each other is the
# apocentre of an orbit of e = 3/4 and a = d/(1 + e).
alone="--set start.n=6 --set start.mass=1e-14 --set start.hole_mass=0.5 --set start.hole_distance=1 --set start.hole_speed=0.5"
expect_status 0 tephra run "$scene" $alone --set time.end=20 --set output.snapshot_every=5 --out pair --threads 1
awk -F, 'function off(x, y) { x = x / y - 1; return x < 0 ? -x : x }
    NR > 1 && (off($7, 8 / 7) > 1e-5 || off($8, 0.75) > 1e-5 || $4 != 0.5 || $2 != 5 || $3 != 6) { print "bad: " $0 }
    NR > 2 && ($9 == "" || $9 > 1e-4 || $9 < -1e-4) { print "hardening: " $0 }
    END { if (NR < 5) print "rows: " NR }' pair/binaries.csv >bad
[ -s bad ] && fail "binaries.csv of a lone pair: $(head -n 3 bad)"
head -n 1 pair/binaries.csv | grep -q '^t \[L V^-1\],id_1,id_2,mass_1 \[M\],.*,eccentricity,hardening \[L^-2 V\]$' ||
    fail "header: $(head -n 1 pair/binaries.csv)"

# Among stars: threads, ranks, restart.
small="--set start.n=150 --set start.hole_mass=0.1 --set start.hole_distance=0.2 --set output.snapshot_every=0.5"
expect_status 0 tephra run "$scene" $small --set time.end=2 --out one --threads 1
[ $(wc -l <one/binaries.csv) -gt 4 ] || fail "no binary: $(cat one/binaries.csv)"
# The contract of snapshots: holes are PartType5 and no stars of PartType4, and a file of them is read as it was written.
tephra info one/snapshot_004.hdf5 >info
grep -q '^star: 148 rows, group PartType4$' info && grep -q '^star: 2 rows, group PartType5$' info ||
    fail "groups of a snapshot with holes: $(grep group info)"
[ $(grep -c BlackHole info) = 1 ] || fail "BlackHole stands not only in PartType5: $(cat info)"
tephra convert one/snapshot_004.hdf5 again.hdf5 && tephra info again.hdf5 | grep -A 2 'PartType5$' | grep -q 'BlackHole  *b  *1 ... 1' ||
    fail "holes are lost in a converted file: $(tephra info again.hdf5)"
expect_status 0 tephra run "$scene" $small --set time.end=2 --out two --threads 2
same one/snapshot_004.hdf5 two/snapshot_004.hdf5
expect_status 0 tephra run "$scene" $small --set time.end=1 --out half --threads 1
echo '1.5,1,2,0' >>half/binaries.csv
printf '1.6,1' >>half/binaries.csv
expect_status 0 tephra run --restart half --set time.end=2 --threads 1
same one/snapshot_004.hdf5 half/snapshot_004.hdf5
cmp -s one/binaries.csv half/binaries.csv || fail "binaries.csv differs after a restart: $(diff one/binaries.csv half/binaries.csv)"
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 mpirun -n 3 --oversubscribe tephra run "$scene" $small --set time.end=2 --out three --threads 1
    same one/snapshot_004.hdf5 three/snapshot_004.hdf5
    cmp -s one/binaries.csv three/binaries.csv || fail "binaries.csv differs on three ranks"
fi

# A start from a file that knows them, and by the other integrators.
tephra ics plummer n=150 species=star holes=2 hole_mass=0.1 hole_distance=0.2 -o start.hdf5
cat >file.yml <<'S'
units: {G: 1}
start: {file: start.hdf5}
time: {end: 2, integrator: leapfrog}
output: {snapshot_every: 0.5}
gravity: {softening: 0.01}
black_holes: {softening: 0.002}
S
expect_status 0 tephra run file.yml --out leap --threads 1
[ $(wc -l <leap/binaries.csv) -gt 2 ] || fail "no binary by leapfrog"
awk -F, 'END { exit !($8 < 1e-2 && $8 > -1e-2) }' leap/energy.csv || fail "leapfrog: $(tail -n 1 leap/energy.csv)"

# Refused, warned of.
expect_status 2 tephra check "$scene" --set black_holes=off
expect_text 'need the block black_holes' err
expect_status 2 tephra check "$scene" --set start.hole_mass=none
expect_text 'start.hole_mass: give it' err
expect_status 2 tephra check "$scene" --set start.n=2
expect_text 'no rows are left' err
expect_status 0 tephra check "$scene" --set start.n=100
expect_text 'needs regularisation' err
expect_status 0 tephra check "$scene" --set start.n=100 --set start.holes=0
expect_text 'hole_mass acts from 1 on' err
expect_text 'the start has none' err
finish
