#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Stars from clouds, alone and in a small dwarf galaxy with all else: the same on 1 and 2 threads, 2 and 4 ranks and after a restart;
# books that close.
. "$TEPHRA_SOURCE/tests/lib.sh"
last() { awk -F, -v name="$2" 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); if ($i == name) at = i } } END { print $at }' "$1"; }
scene=$TEPHRA_SOURCE/ics/dwarf.yml
small="--set start.n=800 --set time.end=50Myr --set cloud_stars.wait=60Myr --set start.lightest=1e5Msun"

expect_status 0 tephra run "$scene" $small --threads 1 --out one
expect_status 0 tephra run "$scene" $small --threads 2 --out two
same one/snapshot_001.hdf5 two/snapshot_001.hdf5
expect_status 0 tephra run "$scene" $small --set output.snapshot_every=25Myr --threads 1 --out steps
expect_status 0 tephra run "$scene" $small --set output.snapshot_every=25Myr --set time.end=25Myr --threads 1 --out half
expect_status 0 tephra run --restart half --set time.end=50Myr
same steps/snapshot_002.hdf5 half/snapshot_002.hdf5
cmp -s steps/budget.csv half/budget.csv || fail "budget.csv differs after a restart"
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    for ranks in 2 4; do
        expect_status 0 mpirun -n $ranks --oversubscribe tephra run "$scene" $small --set output.snapshot_every=25Myr \
            --set time.end=25Myr --threads 1 --out ranks$ranks
        same steps/snapshot_001.hdf5 ranks$ranks/snapshot_001.hdf5
    done
fi
awk -v b="$(last one/budget.csv cloud_births)" -v c="$(last one/budget.csv cloud_coagulations)" 'BEGIN { exit !(b > 10 && c > 5) }' ||
    fail "too little happened: $(tail -n 1 one/budget.csv)"
# The spectrum at a snapshot holds every cloud and all of their mass (1e10 Msun a unit of energy.csv).
awk -F, -v n="$(last one/budget.csv clouds)" -v m="$(last one/energy.csv mass_cloud)" 'NR > 1 { number += $3; mass += $4; bad += $4 < $1 * $3 || $4 > $2 * $3 }
    END { d = mass / (m * 1e10) - 1; exit bad || number != n || d > 1e-6 || d < -1e-6 }' one/cloud_masses_001.csv ||
    fail "spectrum: $(cat one/cloud_masses_001.csv)"
# Mass to 1e-12; energy to 1 % of the largest kinetic one; elements to 1e-10 of what was there and has been made.
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { n = $i; sub(/ .*/, "", n); at[n] = i } }
    NR > 1 { mass = 0; for (n in at) if (n ~ /^mass_/) mass += $at[n]
        if (NR == 2) { first = mass; start = $at["total"] }
        if ($at["kinetic"] > most) most = $at["kinetic"]
        d = mass / first - 1; if (d > 1e-12 || d < -1e-12) bad = 1
        e = $at["total"] - start; if (e > open) open = e; if (-e > open) open = -e }
    END { print open / most; exit bad || open > 0.01 * most }' one/energy.csv >books || fail "books: $(cat books)"
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { n = $i; sub(/ .*/, "", n); at[n] = i } }
    NR > 1 { for (k = 1; k <= 3; k++) { e = k == 1 ? "metals" : k == 2 ? "oxygen" : "iron"
        s = $at[e "_gas"] + $at[e "_star"] + $at[e "_cloud"] - $at[e "_made"]
        if (NR == 2) f[e] = s; d = s / f[e] - 1; if (d > 1e-10 || d < -1e-10) exit bad = 1 } } END { exit bad }' one/budget.csv ||
    fail "elements"

# Heat that all neighbours share: what the fragments had is missing in the heat of 0.1 x 1e51 erg each that supernovae II give (1.98841e53 erg a unit of energy.csv).
expect_status 0 tephra run "$scene" $small --set feedback.variant=thermal --set feedback.efficiency=0.1 --out heat
awk -v n="$(last heat/budget.csv snii)" -v g="$(last heat/energy.csv injected_snii)" -v f="$(last heat/energy.csv injected_fragments)" \
    'BEGIN { paid = n * 1e50 / 1.98841e53 + g; exit !(paid > 0.1 * -f && paid < -f * 1.0001) }' || fail "the fragments were not paid for"

# Said and refused.
expect_status 2 tephra check "$scene" --set clouds=off
expect_text 'needs a block "clouds"' err
for key in wait=100Myr heavy=1e6Msun; do
    expect_status 2 tephra check "$scene" --set cloud_stars.trigger=collision --set cloud_stars.$key
    expect_text "cloud_stars.${key%=*} has a meaning only with trigger: clock" err
done
expect_status 2 tephra check "$scene" --set cloud_stars.colliding=1e6Msun
expect_text 'cloud_stars.colliding has a meaning only with trigger: collision' err
expect_status 2 tephra check "$scene" --set cloud_stars.efficiency=0.1 --set "cloud_stars.yield=1e5 km^2/s^2"
expect_text 'cloud_stars.yield has a meaning only with no efficiency' err
expect_status 0 tephra check one/used.yml
expect_status 2 tephra run "$scene" $small --set gravity.softening=0 --out soft
expect_text 'softening must be above 0' err
finish
