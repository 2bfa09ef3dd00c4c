#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The module of doc/hacking.md, built in as the guide says, brakes the gas and books what it takes: on
# one rank, on two, and when continued from a checkpoint.
. "$TEPHRA_SOURCE/tests/lib.sh"
awk '/^```c$/ { on = 1; next } /^```$/ { on = 0 } on' "$TEPHRA_SOURCE/doc/hacking.md" >module.c
lines=$(wc -l <module.c)
[ "$lines" -gt 20 ] || fail "no module found in doc/hacking.md"
sed '/^#define MODULES/,/^$/s/X(ranks)/X(drag) X(ranks)/' "$TEPHRA_SOURCE/src/modules.c" >modules.c
grep -q 'X(drag)' modules.c || fail "no list of modules to add to"
compile() { ${CC:-cc} -std=gnu17 -Wall -Wextra -Werror -I"$TEPHRA_SOURCE/src" -c "$1.c" -o "$1.o" || fail "$1.c does not compile"; }
compile module
compile modules
libraries=$(make -s --no-print-directory -C "$TEPHRA_BUILD" --eval='libraries: ; @echo $(TEPHRA_LIBS) $(LIBS)' libraries)
(cd "$TEPHRA_BUILD" && ${CC:-cc} -fopenmp src/main.o "$scratch/module.o" "$scratch/modules.o" $libraries -o "$scratch/tephra") ||
    fail "the program with the module does not link"

scene=$TEPHRA_SOURCE/ics/evrard.yml
small="--set start.n=1000 --set output.snapshot_every=0.1 --set drag={} --set drag.time=3"
# booked RUN: the energy booked by the module in the last row.
booked() { awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /^booked_drag/) c = i } END { print $c }' "$1/energy.csv"; }
expect_status 0 ./tephra run "$scene" $small --set time.end=0.2 --out one
awk -v e="$(booked one)" 'BEGIN { exit !(e > 0) }' || fail "nothing is booked"
if ! tephra --version | grep -q 'MPI *no' && command -v mpirun >/dev/null; then
    ranks="mpirun -n 2 --oversubscribe ./tephra run"
    expect_status 0 $ranks "$scene" $small --set time.end=0.1 --threads 1 --out two
    expect_status 0 $ranks --restart two --set time.end=0.2 --threads 1
    printf '%.9g %.9g\n' "$(booked one)" "$(booked two)" | awk '{ d = $1 - $2; exit !(d * d <= 1e-16 * $1 * $1) }' ||
        fail "booked on one rank: $(booked one), on two after a restart: $(booked two)"
fi
finish
