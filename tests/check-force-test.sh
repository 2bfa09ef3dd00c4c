#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# `tephra force-test`: its table, the errors of every solver, the file it writes, its answers to
# mistakes; threads and ranks change no bit.
. "$TEPHRA_SOURCE/tests/lib.sh"

expect_status 0 tephra ics plummer n=4000 -o a.hdf5
test_forces() { expect_status 0 tephra force-test a.hdf5 --set gravity.softening=0.01 "$@"; }

# below LIMIT: of every line of the table, the 99th percentile and the number of rows tested.
below() {
    awk -F, -v limit="$1" 'NR == 1 { good = $0 == "solver,setting,n,threads,build_cpu_s,walk_cpu_s,rms,median,p99,max" }
        NR > 1 { good = good && NF == 10 && $3 == 4000 && $8 <= $9 && $9 <= $10 && $9 <= limit && $9 > 0 }
        END { exit !(good && NR > 1) }' out_text || { fail "not a table of errors below $1"; cat out_text; }
}
test_forces --set gravity.solver=direct;                                below 1e-5
test_forces --set gravity.solver=direct --set gravity.precision=double; below 1e-6
# `accuracy` has a floor for small accelerations, which the table has not.
for solver in tree fmm; do
    test_forces --set gravity.solver=$solver --set gravity.accuracy=1e-2; below 3e-2
    test_forces --set gravity.solver=$solver --set gravity.accuracy=1e-3; below 3e-3
done

# Every instruction set that this processor has; the oldest is always there.
test_forces --set gravity.solver=fmm --isa v2; below 3e-3
expect_status 2 tephra force-test a.hdf5 --isa v5
expect_text 'isa v5: expects v2, v3 or v4' err

# A line for every repetition; a tree is built anew and gives the same forces.
test_forces --set gravity.solver=tree --repeat 3 --sample 200
[ "$(wc -l <out_text)" -eq 4 ] || fail "$(wc -l <out_text) lines, not 4"
[ "$(sed 1d out_text | cut -d, -f7- | sort -u | wc -l)" -eq 1 ] || fail 'repetitions differ'

# All rows are written; threads and ranks change nothing.
for solver in tree fmm; do
    test_forces --set gravity.solver=$solver --threads 1 --out one.hdf5
    test_forces --set gravity.solver=$solver --threads 2 --out two.hdf5
    same one.hdf5 two.hdf5
    tephra --version | grep -q 'MPI *no' && continue
    command -v mpirun >/dev/null || continue
    expect_status 0 mpirun -n 2 --oversubscribe tephra force-test a.hdf5 --set gravity.softening=0.01 \
        --set gravity.solver=$solver --threads 1 --out ranks.hdf5
    same one.hdf5 ranks.hdf5
done
expect_status 0 tephra info one.hdf5
for name in ParticleIDs Acceleration Potential; do expect_text "$name" out_text; done

# wrong WORDS ARGUMENTS...: status 2 and those words.
wrong() { text=$1; shift; expect_status 2 tephra force-test "$@"; expect_text "$text" err; }
wrong 'usage: tephra force-test'
wrong 'none.hdf5' none.hdf5
wrong 'did you mean "softening"' a.hdf5 --set gravity.softning=1
wrong 'accuracy' a.hdf5 --set gravity.accuracy=2
wrong 'sph' a.hdf5 --set sph.neighbours=50
wrong 'whole number' a.hdf5 --sample 0
wrong 'whole number' a.hdf5 --repeat 1.5
wrong 'not an option' a.hdf5 --restart b
wrong 'no forces to test' a.hdf5 --set gravity=off
echo 'no file of this kind' >text.hdf5
wrong 'text.hdf5' text.hdf5
expect_status 5 tephra force-test a.hdf5 --out nowhere/b.hdf5
finish
