#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Stars that return mass, elements and energy: what populations.md says is due, books that close, the
# same stars on 1 and 2 threads, on two ranks and after a restart.
. "$TEPHRA_SOURCE/tests/lib.sh"
scene=$TEPHRA_SOURCE/ics/ssp_box.yml
small="--set start.n=410 --set time.end=50Myr"
# column FILE NAME LINE: a number of energy.csv; line 2 is the start.
column() { awk -F, -v name="$2" -v line="$3" 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); if ($i == name) at = i } next }
    { last = $at } NR == line { print last; done = 1; exit } END { if (!done) print last }' "$1"; }
near() { awk -v a="$1" -v b="$2" -v t="$3" 'BEGIN { d = a - b; if (d < 0) d = -d; if (b < 0) b = -b; exit !(d <= t * b) }'; }

expect_status 0 tephra run "$scene" $small --threads 1 --out one
expect_status 0 tephra run "$scene" $small --threads 2 --out two
same one/snapshot_004.hdf5 two/snapshot_004.hdf5
expect_status 0 tephra run "$scene" $small --set time.end=25Myr --out half
expect_status 0 tephra run --restart half --set time.end=50Myr
same one/snapshot_004.hdf5 half/snapshot_004.hdf5
cut -d, -f1-13 one/energy.csv >a; cut -d, -f1-13 half/energy.csv >b
cmp -s a b || fail "energies differ after a restart"
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 mpirun -n 2 --oversubscribe tephra run "$scene" $small --out ranks
    same one/snapshot_004.hdf5 ranks/snapshot_004.hdf5
fi

# 1e5 Msun of stars, 50 Myr old: 497.5 supernovae of 1e50 erg (1.98841e53 erg is one unit of energy), 0.06256
# of the mass from them and 0.0091 from winds within a portion of 1e-4.
energies=one/energy.csv
near "$(column $energies injected_snii 0)" -0.250195 1e-3 || fail "energy of SNII: $(column $energies injected_snii 0)"
returned=$(awk -v s="$(column $energies mass_star 0)" 'BEGIN { print 1 - s / 1e-5 }')
near "$returned" 0.0716 0.01 || fail "the stars returned $returned of their mass"

# Books: mass of gas and stars, energy.
for line in 10 40 0; do
    awk -v g="$(column $energies mass_gas $line)" -v s="$(column $energies mass_star $line)" \
        -v g0="$(column $energies mass_gas 2)" -v s0="$(column $energies mass_star 2)" \
        'BEGIN { d = (g + s) / (g0 + s0) - 1; exit !(d < 1e-12 && d > -1e-12) }' || fail "mass is not conserved"
done
near "$(column $energies total 0)" "$(column $energies total 2)" 1e-3 || fail "energy: $(column $energies error 0)"

# conserved FILE ELEMENTS: what gas and stars hold is what they began with and what was made, in each row.
conserved() {
    awk -F, -v names="$2" 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); at[$i] = i } next }
        { for (k = split(names, name, " "); k > 0; k--) {
            all = $at[name[k] "_gas"] + $at[name[k] "_star"] - $at[name[k] "_made"]
            if (NR == 2) first[k] = all
            d = all / first[k] - 1
            if (d > 1e-10 || d < -1e-10 || !(name[k] "_made" in at)) { print name[k], d; bad = 1 }
            if ($at[name[k] "_made"] > 0) made[k] = 1 } }
        END { for (k in name) bad += !made[k]; exit bad || NR < 6 }' "$1"
}
conserved one/budget.csv "metals oxygen iron" || fail "elements are not conserved"
near "$(column one/budget.csv snii 0)" 497.46 1e-3 || fail "supernovae: $(column one/budget.csv snii 0)"
cmp -s one/budget.csv half/budget.csv || fail "budget.csv differs after a restart"

# The other ways to give energy: the same on 1 and 2 threads, with books that close.
for variant in stochastic momentum; do
    for threads in 1 2; do
        expect_status 0 tephra run "$scene" $small --set feedback.variant=$variant --set feedback.heating=1e6K \
            --threads $threads --out $variant$threads
    done
    same ${variant}1/snapshot_004.hdf5 ${variant}2/snapshot_004.hdf5
    near "$(column ${variant}1/energy.csv total 0)" "$(column ${variant}1/energy.csv total 2)" 1e-2 ||
        fail "energy, $variant: $(column ${variant}1/energy.csv error 0)"
done
# Heated at random: 0.25 in the mean, in jumps of 0.0175.
near "$(column stochastic1/energy.csv injected_snii 0)" -0.25 0.9 || fail "heated: $(column stochastic1/energy.csv injected_snii 0)"

# Rows that become a thousand times hotter at once: 2.6e-3 of the thermal energy (1.1e-2 without a shorter first step).
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/star_box.yml" --set start.n=1000 --set "time.end=125 Myr" --set feedback.variant=stochastic --out jumps
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); at[$i] = i } next }
    NR == 2 { first = $at["total"] } { heat = $at["thermal"] > heat ? $at["thermal"] : heat; off = $at["total"] - first }
    END { exit !(off < 5e-3 * heat && off > -5e-3 * heat && $at["injected_snii"] < -heat) }' jumps/energy.csv ||
    fail "energy of jumps: $(tail -n 1 jumps/energy.csv)"

# Oxygen and iron of gas and stars: no less in stars, more in the gas.
tephra info one/snapshot_004.hdf5 >info
grep -A30 '^gas' info | grep -m1 Oxygen | awk '{ exit !($5 > 0.0088) }' || fail "no oxygen in the gas: $(grep Oxygen info)"
grep -A30 '^star' info | grep -m1 Iron | awk '{ exit !($3 == $5) }' || fail "the stars' own iron changed"

# A list of elements: a column for each that it names, in files, budget and books, and for no other.
elements="carbon nitrogen oxygen neon magnesium silicon sulfur calcium iron"
sed 's/^  imf: .*/&\n  snii: portinari1998\n  elements: [C, N, O, Ne, Mg, Si, S, Ca, Fe]/' "$scene" >elements.yml
expect_status 0 tephra run elements.yml $small --out elements
conserved elements/budget.csv "metals $elements" || fail "elements of the list are not conserved"
tephra info elements/snapshot_004.hdf5 >info
for name in Carbon Nitrogen Oxygen Neon Magnesium Silicon Sulfur Calcium Iron; do
    [ "$(grep -c "${name}Fraction" info)" -eq 2 ] || fail "no ${name}Fraction of gas and stars"
done
tephra info one/snapshot_004.hdf5 | grep -q Carbon && fail "a column of carbon that nobody asked for"
near "$(column elements/budget.csv snii 0)" 524.7 1e-3 || fail "supernovae of 8 to 100 Msun: $(column elements/budget.csv snii 0)"
sed 's/^  imf: .*/  elements: []/' "$scene" >metals.yml
expect_status 0 tephra run metals.yml --set start.n=410 --set time.end=12.5Myr --out metals
head -n 1 metals/budget.csv | grep -q 'metals_gas' || fail "no metals"
head -n 1 metals/budget.csv | grep -q 'oxygen' && fail "oxygen that nobody asked for"
expect_status 2 tephra check "$scene" --set "feedback.elements=O, Mg" --set feedback.winds=on
expect_text 'Mg needs snii: portinari1998' err
expect_status 2 tephra check "$scene" --set "feedback.elements=O, Xe" --set feedback.snii=portinari1998 --set feedback.winds=on
expect_text 'no yields of "Xe"' err
expect_text 'hold the winds of massive stars already' err

# Winds: 1.010e5 years a Msun of stars, 0.1 of 1e35 erg/s each; 7.2 % of the mass is returned all the same.
expect_status 0 tephra run "$scene" $small --set feedback.winds=on --out winds
near "$(column winds/energy.csv injected_wind 0)" -0.016029 2e-3 || fail "energy of winds: $(column winds/energy.csv injected_wind 0)"
near "$(column winds/energy.csv injected_snii 0)" -0.250195 1e-3 || fail "SNII with winds: $(column winds/energy.csv injected_snii 0)"
near "$(column winds/energy.csv mass_star 0)" "$(column $energies mass_star 0)" 2e-4 || fail "mass with winds"
near "$(column winds/energy.csv total 0)" "$(column winds/energy.csv total 2)" 1e-3 || fail "energy: $(column winds/energy.csv error 0)"
head -n 1 $energies | grep -q wind && fail "winds have a column where there are none"

# One step longer than the lives of all stars that explode pays for all of them.
expect_status 0 tephra run "$scene" --set start.n=410 --set time.end=50Myr --set output.snapshot_every=50Myr --set feedback.time_step=1000 --out long
expect_text 'feedback.time_step: 1000' long/log.txt
near "$(column long/energy.csv injected_snii 0)" -0.250195 1e-3 || fail "SNII of one step: $(column long/energy.csv injected_snii 0)"
near "$(column long/energy.csv mass_star 0)" "$(column $energies mass_star 0)" 2e-4 || fail "mass of one step"

# Stars that are old at the start: what is left of 1.24 times as many (0.0626 + 0.1310 + 0.0006 returned), no SNII any more.
expect_status 0 tephra run "$scene" $small --set "feedback.age=1 Gyr" --out old
tephra info old/snapshot_000.hdf5 | awk '/InitialMass/ { exit !($3 > 1.239e-6 && $3 < 1.243e-6 && $5 == $3) }' ||
    fail "mass at birth: $(tephra info old/snapshot_000.hdf5 | grep InitialMass)"
near "$(column old/energy.csv injected_snii 0)" 0 1e-12 || fail "SNII of old stars: $(column old/energy.csv injected_snii 0)"
near "$(column old/energy.csv injected_snia 0)" "$(column old/energy.csv injected_snia 0)" 1 && [ "$(column old/energy.csv injected_snia 0)" != 0 ] ||
    fail "no SNIa of old stars"

# Told: rows too heavy for supernovae, and such that overshoot.
expect_status 0 tephra check "$scene"
expect_text 'radiate the heat of a supernova' err
expect_status 0 tephra check "$TEPHRA_SOURCE/ics/supernova.yml" --set start.n=8192 --set feedback={}
expect_text 'up to twice its momentum where n_H is above 0.13' err
expect_status 0 tephra check "$TEPHRA_SOURCE/ics/supernova.yml" --set feedback={}
expect_text 'resolve supernovae, for which 1 is due' err

# Refused.
expect_status 2 tephra check "$scene" --set sph=off
expect_text 'block "feedback" needs a block "sph"' err
expect_status 2 tephra check "$scene" --set feedback.imf=kroupa
expect_text 'kroupa1993' err
finish
