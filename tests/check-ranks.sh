#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Several ranks give the same run as one: bit for bit, since cells, groups and the order of sums follow
# from the keys alone. Whether every rank holds all rows, or its own and what it asks for.
. "$TEPHRA_SOURCE/tests/lib.sh"
tephra --version | grep -q 'MPI *no' && { echo "built without MPI"; exit 77; }
command -v mpirun >/dev/null || { echo "there is no mpirun"; exit 77; }

scene=$TEPHRA_SOURCE/ics/evrard.yml
small="--set start.n=2000 --set time.end=0.2 --set output.snapshot_every=0.1 --threads 1"
expect_status 0 tephra run "$scene" $small --out one
for ranks in 2 3; do
    expect_status 0 mpirun -n $ranks --oversubscribe tephra run "$scene" $small --out ranks$ranks
    for k in 0 1 2; do same one/snapshot_00$k.hdf5 ranks$ranks/snapshot_00$k.hdf5; done
done

expect_text 'every rank holds all rows, because of direct sums' ranks2/log.txt

# What they cost, side by side: a line a run, the efficiency of one rank is 1; what is no run leaves no file.
expect_status 0 tephra chart ranks runs="one ranks2 ranks3"
awk -F, '$2 == 2000 { n++; sum = $5 + $6 + $8; if ((sum - $10) ^ 2 > 1e-6 || !($3 == 1 ? $11 == 1 : $11 > 0 && $13 > 0)) bad = 1 }
         END { exit bad || n != 3 }' ranks.csv || fail "unexpected: $(cat ranks.csv)"
mkdir none
expect_status 2 tephra chart ranks other.csv runs="one none"; expect_text 'none/ranks.csv: No such file' err
echo "rank,bytes" >none/ranks.csv
expect_status 2 tephra chart ranks other.csv runs="one none"; expect_text 'is no ranks.csv of this program' err
[ ! -e other.csv.tmp ] || fail "a mistake leaves other.csv.tmp"

# Rows spread over the ranks: with steps of their own, more ranks than cells that may not be cut, other equations, a tree, a
# corrector that moves rows, two species, a closed box; nothing is lost where all ranks but one are empty.
spread() {      # RANKS SCENE ARGUMENTS...
    ranks=$1; shift
    rm -rf alone many
    expect_status 0 tephra run "$@" --threads 1 --out alone
    expect_status 0 mpirun -n "$ranks" --oversubscribe tephra run "$@" --threads 1 --out many
    grep -q 'every rank holds all' many/log.txt && fail "not spread: $*"
    for file in alone/snapshot_*.hdf5; do same "$file" "many/${file#alone/}"; done
}
few="--set time.end=0.05 --set output.snapshot_every=0.025"
spread 2 "$scene" --set start.n=6000 --set time.end=0.2 --set output.snapshot_every=0.1
for ranks in 4 8; do spread $ranks "$scene" --set start.n=6000 $few; done
spread 4 "$scene" --set start.n=600 $few --set gravity.solver=fmm
spread 3 "$scene" --set start.n=3000 $few --set gravity.solver=tree --set time.integrator=pec
spread 3 "$scene" --set start.n=3000 $few --set sph.preset=modern --set sph.count=smooth --set sph.grad_h=on \
    --set sph.equation=entropy
spread 3 "$scene" --set start.n=3000 $few --set gravity.solver=fmm --set gravity.mutual=on
spread 3 "$scene" --set start.n=3000 $few --set gravity.softening_kernel=spline --set gravity.softening_adaptive=on
spread 3 "$TEPHRA_SOURCE/ics/merger.yml" --set start.n=3000 --set time.end=2Myr --set output.snapshot_every=2Myr
spread 3 "$TEPHRA_SOURCE/ics/wave.yml" --set time.end=0.02 --set output.snapshot_every=0.02

# From a file each rank reads its part: rows in two groups of a species, without ids, with fewer rows than ranks; what is
# wrong with a part of one rank, or between those of two, is told once.
rows() {        # NAME ROWS AWK: a file of dark rows and stars, changed by awk
    awk 'BEGIN { srand(2); print "species,id,x,y,z,vx,vy,vz,mass"; n = '"$2"'
                 for (i = 1; i <= n + 2; i++) { id = i; m = 1 / n; '"$3"'
                     printf "%s,%d,%.9g,%.9g,%.9g,0,0,0,%.9g\n", (i > n ? "star" : "dark"), id, rand(), rand(), rand(), m } }' >"$1.csv"
    printf 'units: {G: 1}\nstart: {file: %s.csv}\ntime: {end: 0.002}\noutput: {snapshot_every: 0.001}\n' "$1" >"$1.yml"
    printf 'gravity: {softening: 0.01, solver: fmm}\n' >>"$1.yml"
}
rows parts 1500 ''
spread 3 parts.yml
rows bad 1500 'if (i == 1400) m = -1'
expect_status 2 mpirun -n 3 --oversubscribe tephra run bad.yml --out bad
[ "$(grep -c 'dark particle 1400 has Masses = -1' err)" -eq 1 ] || fail "not told once: $(cat err)"
rows twice 1500 'if (i == 1400 || i == 3) id = 7'
expect_status 2 mpirun -n 3 --oversubscribe tephra run twice.yml --out bad
[ "$(grep -c 'the id 7 is used twice (dark and dark), as are 1 more' err)" -eq 1 ] || fail "not told once: $(cat err)"

# A run of spread rows, continued on another number of ranks.
expect_status 0 mpirun -n 3 --oversubscribe tephra run "$scene" --set start.n=3000 $few --set time.end=0.025 --threads 1 --out part
expect_status 0 mpirun -n 2 --oversubscribe tephra run --restart part --set time.end=0.05 --threads 1
expect_status 0 tephra run "$scene" --set start.n=3000 $few --threads 1 --out all
same all/snapshot_002.hdf5 part/snapshot_002.hdf5

# Continued on other ranks: the same bits, and the same gain of steps of their own.
expect_status 0 mpirun -n 2 --oversubscribe tephra run "$scene" $small --set time.end=0.1 --out half
expect_status 0 tephra run --restart half --set time.end=0.2 --threads 1
same one/snapshot_002.hdf5 half/snapshot_002.hdf5
for run in one ranks2 ranks3 half; do grep '^steps of their own' $run/log.txt | tail -n 1 >$run.gain; done
for run in ranks2 ranks3 half; do
    cmp -s one.gain $run.gain || fail "gain of steps in $run: $(cat $run.gain), not $(cat one.gain)"
done

# The same with the other equations of the gas.
other="--set sph.preset=modern --set sph.count=smooth --set sph.grad_h=on --set sph.equation=entropy"
expect_status 0 tephra run "$scene" $small $other --out modern
expect_status 0 mpirun -n 3 --oversubscribe tephra run "$scene" $small $other --out modern3
same modern/snapshot_002.hdf5 modern3/snapshot_002.hdf5

# An integrator whose potentials are computed when they are written.
expect_status 0 tephra run "$scene" $small --set time.integrator=pec --out pec
expect_status 0 mpirun -n 2 --oversubscribe tephra run "$scene" $small --set time.integrator=pec --out pec2
same pec/snapshot_002.hdf5 pec2/snapshot_002.hdf5

# A mistake is told once and ends all ranks with the same status.
expect_status 2 mpirun -n 2 --oversubscribe tephra run "$scene" --set sph.neigbours=40 --out bad
[ "$(grep -c 'did you mean' err)" -eq 1 ] || fail "the message stands $(grep -c 'did you mean' err) times"

expect_status 2 mpirun -n 2 --oversubscribe tephra run "$scene" --thraed 1
[ "$(grep -c 'not an option' err)" -eq 1 ] || fail "the message stands $(grep -c 'not an option' err) times"
expect_status 0 mpirun -n 2 --oversubscribe tephra --version
[ "$(grep -c '^tephra' out_text)" -eq 1 ] || fail "the version stands $(grep -c '^tephra' out_text) times"

# Numbers that fail end all ranks with 3; the reason is told once, in the log too.
expect_status 3 mpirun -n 2 --oversubscribe tephra run "$scene" $small --set output.energy_limit=1e-12 --out failed
[ "$(grep -c 'energy_limit = ' err)" -eq 1 ] || fail "the reason stands $(grep -c 'energy_limit = ' err) times"
expect_text 'energy_limit = ' failed/log.txt
finish
