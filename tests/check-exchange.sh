#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Clouds in hot gas: the same on 1 and 2 threads, on two ranks and after a restart, rows of gas split; books that close.
. "$TEPHRA_SOURCE/tests/lib.sh"
scene=$TEPHRA_SOURCE/ics/exchange_box.yml
small="--set start.n=266 --set start.clouds=10 --set time.end=50Myr --set start.speed=30km/s"
last() { awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); if ($i == name) at = i } } END { print $at }' "$1"; }

expect_status 0 tephra run "$scene" $small --threads 1 --out one
expect_status 0 tephra run "$scene" $small --threads 2 --out two
same one/snapshot_002.hdf5 two/snapshot_002.hdf5
expect_status 0 tephra run "$scene" $small --set time.end=25Myr --out half
expect_status 0 tephra run --restart half --set time.end=50Myr
same one/snapshot_002.hdf5 half/snapshot_002.hdf5
cmp -s one/budget.csv half/budget.csv || fail "budget.csv differs after a restart"
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 mpirun -n 2 --oversubscribe tephra run "$scene" $small --threads 1 --out ranks
    same one/snapshot_002.hdf5 ranks/snapshot_002.hdf5
fi
awk -v s="$(last one/budget.csv gas_split)" -v e="$(last one/budget.csv evaporated)" 'BEGIN { exit !(s > 0 && e > 1e4) }' ||
    fail "nothing happened: $(tail -n 1 one/budget.csv)"
awk -v e="$(last one/energy.csv error)" 'BEGIN { exit !(e < 1e-3 && e > -1e-3) }' || fail "energy: $(last one/energy.csv error)"

# Refused.
expect_status 2 tephra check "$scene" --set clouds=off
expect_text 'needs a block "clouds"' err
expect_status 2 tephra run "$scene" --set clouds.power=0 --out power
expect_text 'clouds.power' err
finish
