#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What goes wrong between ranks: one is killed, at any moment; one row reaches all domains; domains of very different
# size, or empty ones; messages are late.
. "$TEPHRA_SOURCE/tests/lib.sh"
tephra --version | grep -q 'MPI *no' && { echo "built without MPI"; exit 77; }
command -v mpirun >/dev/null || { echo "there is no mpirun"; exit 77; }

scene=$TEPHRA_SOURCE/ics/evrard.yml
often="--set start.n=2000 --set time.end=0.4 --set output.snapshot_every=0.025 --set output.picture_every=0.4
       --set output.checkpoint_every=0.025 --threads 1"

# A killed rank ends the run, mpirun says which it was; every file that has its name is whole, and the run goes on from the last
# checkpoint to the same end. Killed at different moments, so that files being written are met too.
expect_status 0 tephra run "$scene" $often --out whole
for more in 0 0.2; do
    rm -rf killed
    mpirun -n 2 --oversubscribe tephra run "$scene" $often --out killed >said 2>&1 &
    job=$!
    until [ -e killed/checkpoint.previous.hdf5 ] || ! kill -0 $job 2>/dev/null; do sleep 0.05; done
    sleep $more
    victim=$(pgrep -P $job | tail -n 1)
    [ -z "$victim" ] || kill -9 "$victim"
    wait $job && [ -n "$victim" ] && [ ! -e killed/snapshot_016.hdf5 ] && fail "a killed rank ends with status 0"
    [ -e killed/snapshot_016.hdf5 ] || grep -q 'exited on signal 9' said || fail "mpirun does not say which rank was killed: $(tail -n 3 said)"
    for file in killed/snapshot_*.hdf5; do expect_status 0 tephra info "$file"; done
    expect_status 0 mpirun -n 2 --oversubscribe tephra run --restart killed --threads 1
    same whole/snapshot_016.hdf5 killed/snapshot_016.hdf5
    grep -c '^[0-9]' killed/energy.csv >lines; cut -d, -f1 killed/energy.csv | sort -u | grep -c '^[0-9]' >times
    cmp -s lines times || fail "energy.csv has a time twice"
done

# rows NAME END AWK: a file of 1000 gas rows, their places p(i) by awk.
rows() {
    awk 'function place(scale) { for (k = 0; k < 3; k++) p[k] = scale * (2 * rand() - 1) }
         BEGIN { srand(1); print "species,id,x,y,z,vx,vy,vz,mass,u"; n = 1000
                 for (i = 1; i <= n; i++) { '"$3"'; printf "gas,%d,%.9g,%.9g,%.9g,0,0,0,%.9g,0.05\n", i, p[0], p[1], p[2], 1 / n } }' >"$1.csv"
    cat >"$1.yml" <<END
units: {G: 1}
start: {file: $1.csv}
time: {end: $2}
output: {snapshot_every: $2}
gravity: {softening: 0.001, solver: fmm}
sph: {}
END
    expect_status 0 tephra run "$1.yml" --threads 1 --out "$1-alone"
    for ranks in 3; do
        expect_status 0 mpirun -n $ranks --oversubscribe tephra run "$1.yml" --threads 1 --out "$1-$ranks"
        grep -q 'every rank holds all' "$1-$ranks/log.txt" && fail "$1: not spread"
        same "$1-alone/snapshot_001.hdf5" "$1-$ranks/snapshot_001.hdf5"
    done
}
# A lone row far away: its kernel reaches every domain.
rows lone 0.004 'place(i == n ? 200 : 1)'
# Half of all rows in a millionth of the volume.
rows dense 0.001 'place(i % 2 ? 1 : 0.01)'
# All but ten rows at one end: what lies between is nobody'\''s.
rows lopsided 0.00002 'place(0.001); if (i % 300 == 0) p[0] += 1000'

# Messages that come late, on every rank by other times: the same bits, files too.
if command -v mpicc >/dev/null; then
    mpicc -shared -fPIC -o slow_mpi.so "$TEPHRA_SOURCE/tests/slow_mpi.c" || fail "slow_mpi.c does not compile"
    short="--set start.n=3000 --set time.end=0.025 --set output.snapshot_every=0.025 --threads 1"
    expect_status 0 tephra run "$scene" $short --out prompt
    expect_status 0 mpirun -n 4 --oversubscribe -x LD_PRELOAD="$PWD/slow_mpi.so" tephra run "$scene" $short --out late
    same prompt/snapshot_001.hdf5 late/snapshot_001.hdf5
fi
finish
