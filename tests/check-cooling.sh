#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Cooling in a run: the total closes with what is booked, also after a restart and on 1 and 2 threads;
# nothing is below the floor; scenes that cannot cool are refused; boundaries are told.
. "$TEPHRA_SOURCE/tests/lib.sh"
cat >ball.yml <<TEXT
title: gas that cools
units: {length: kpc, mass: 1e10 Msun, velocity: km/s}
start: {generator: uniform, species: gas, n: 1000, mass: 0.001, radius: 10, u: 2.6e3}
time: {end: 0.2}
output: {snapshot_every: 0.05}
sph: {}
cooling: {}
TEXT
expect_status 0 tephra run ball.yml --threads 1 --out one
expect_status 0 tephra run ball.yml --threads 2 --out two
same one/snapshot_004.hdf5 two/snapshot_004.hdf5
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); at[$i] = i } next }
    { thermal = $at["thermal"]; radiated = $at["radiated"]; error = $at["error"] }
    NR == 2 { first = thermal }
    END { exit !(radiated > 0.1 * first && thermal < 0.9 * first && error < 2e-3 && error > -2e-3) }' one/energy.csv ||
    fail "the books do not close: $(tail -n 1 one/energy.csv)"

# Below the floor gas is raised, and what that takes is booked.
expect_status 0 tephra run ball.yml --set start.u=1 --out cold
tephra info cold/snapshot_004.hdf5 | grep -q 'Temperature .* 10000 \.\.\.' || fail "not at the floor"
awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); at[$i] = i } next }
    END { exit !($at["heated_floor"] < -0.05 && $at["total"] > 0) }' cold/energy.csv || fail "heat of the floor is not booked"

# Bit for bit after a restart, what is booked too.
expect_status 0 tephra run ball.yml --set time.end=0.1 --out half
expect_status 0 tephra run --restart half --set time.end=0.2
same one/snapshot_004.hdf5 half/snapshot_004.hdf5
cut -d, -f1-11 one/energy.csv >a; cut -d, -f1-11 half/energy.csv >b
cmp -s a b || fail "energies differ after a restart"

# The scene: 7.714e6 K after 10 Myr at the density asked for; that of SPH is half a percent less.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/cooling_box.yml" --set start.n=200 --set start.temperature=1e7K --set start.hydrogen=0.71 \
    --set cooling.constant_mu=0.6 --set cooling.hydrogen=0.71 --set time.end=10Myr --set output.snapshot_every=2.5Myr --out box
tephra info box/snapshot_004.hdf5 | grep -Eq 'Temperature .* 7\.7[0-4][0-9]*e\+06 \.\.\. 7\.7[0-4]' ||
    fail "isochoric cooling: $(tephra info box/snapshot_004.hdf5 | grep Temperature)"

# Gas starts at the temperature asked for, whatever its particles weigh there.
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/cooling_box.yml" --set start.n=200 --set start.temperature=1.5e4K \
    --set time.end=1e-3Myr --set output.snapshot_every=1e-3Myr --out warm
tephra info warm/snapshot_000.hdf5 | grep -q 'Temperature .* 15000 \.\.\. 15000 ' ||
    fail "not at 15000 K: $(tephra info warm/snapshot_000.hdf5 | grep Temperature)"

# Two phases: cold clouds and a warm medium, every row in balance n L = Gamma (Koyama & Inutsuka 2002).
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/two_phase_box.yml" --set start.n=512 --set "time.end=60 Myr" --out phases
tephra info phases/snapshot_006.hdf5 | awk '/Temperature/ { exit !($3 < 150 && $5 > 5000) }' ||
    fail "no two phases: $(tephra info phases/snapshot_006.hdf5 | grep Temperature)"

# The diagram holds all of the gas, all but a hundredth of it where n_H = Gamma/L(T).
awk -F, 'FNR == 1 { file++; next } file == 1 { gas = $(NF - 3) * 1e10 }
    file == 2 { sum += $3; t = 10 ^ $2; l = 1e7 * exp(-1.184e5 / (t + 1000)) + 1.4e-2 * sqrt(t) * exp(-92 / t)
        off = $1 + log(l) / log(10); if (off < 0.2 && off > -0.2) near += $3 }
    END { exit !(sum > 0.999999 * gas && sum < 1.000001 * gas && near > 0.99 * gas) }' phases/energy.csv phases/phase_006.csv ||
    fail "phase diagram: $(wc -l <phases/phase_006.csv) cells"
[ "$(head -c 4 phases/phase_006.png | tail -c 3)" = PNG ] || fail "no picture of the phases"
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/two_phase_box.yml" --set phase_diagram.log_density=3
expect_text 'two whole numbers' err

# A supernova at shell formation: 0.57 of its energy is left, half of it kinetic (0.05 more was there before).
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/supernova.yml" --set "time.end=0.05 Myr" --set output.energy_every=0.0125Myr --out shell
tail -n 1 shell/energy.csv | awk -F, '{ erg = 0.005028; exit !($4 > 0.25 * erg && $4 < 0.3 * erg && $5 > 0.32 * erg && $5 < 0.37 * erg) }' ||
    fail "supernova: $(tail -n 1 shell/energy.csv)"

# Refused and warned.
sed 's/^units:.*/units: {G: 1}/' ball.yml >plain.yml
expect_status 2 tephra check plain.yml
expect_text 'physical units' err
expect_status 2 tephra check ball.yml --set sph.eos=isothermal --set sph.sound_speed=1
expect_text 'isothermal' err
expect_status 2 tephra check ball.yml --set sph=off
expect_text 'needs a block "sph"' err
echo '4 -23' >table.txt
expect_status 2 tephra check ball.yml --set cooling.table=table.txt
expect_text 'table.txt:1' err
expect_status 0 tephra check ball.yml --set cooling.metallicity=0.2
expect_text 'beyond the table' err
expect_status 0 tephra run ball.yml --set start.u=1e8 --set time.end=0.001 --set output.snapshot_every=0.001 --out hot
expect_text 'hotter than the table' err
finish
