#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Stars from gas: the rate of the Schmidt law, the Jeans criterion in a collapse; mass and energy in the
# books; the same stars on 1 and 2 threads, on three ranks and after a restart.
. "$TEPHRA_SOURCE/tests/lib.sh"
cat >even.yml <<TEXT
units: {length: kpc, mass: 1e10 Msun, velocity: km/s}
box: {x: 1, y: 1, z: 1}
start: {generator: medium, n: 1000, n_h: 1 cm^-3, hydrogen: 0.76, temperature: 2e4 K}
time: {end: 250 Myr}
output: {snapshot_every: 62.5 Myr}
sph: {}
cooling: {}
star_formation: {criterion: schmidt, rate: 0.1, spawned: 0.1, converging: off}
TEXT
cat >ball.yml <<TEXT
units: {length: kpc, mass: 1e10 Msun, velocity: km/s}
start: {generator: uniform, species: gas, n: 300, mass: 0.1, radius: 5, u: 2000}
time: {end: 0.22, dt_max: 0.01}
output: {snapshot_every: 0.01, energy_every: 0.00125}
gravity: {softening: 0.1 kpc, accuracy: 1e-2}
sph: {}
cooling: {}
star_formation: {}
feedback: {}
TEXT
# mass_gas, mass_star, error of the last row of energy.csv
last() { awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) { sub(/ .*/, "", $i); at[$i] = i } next }
    { g = $at["mass_gas"]; s = $at["mass_star"]; if (NR == 2) all = g + s; d = (g + s) / all - 1; if (d * d > 1e-24) bad = 1; e = $at["error"] }
    END { print g, s, e, bad + 0 }' "$1/energy.csv"; }

# m/m0 = (1 + c t / (2 t_ff))^-2 where rho falls with the mass; t_ff = 44.9 Myr at the start.
expect_status 0 tephra run even.yml --threads 1 --out even1
expect_status 0 tephra run even.yml --threads 2 --out even2
same even1/snapshot_004.hdf5 even2/snapshot_004.hdf5
last even1 | awk '{ left = $1 / ($1 + $2); k = 0.1 * 250 / 44.9; wanted = 1 / (1 + k / 2) ^ 2
    exit !(left > 0.98 * wanted && left < 1.02 * wanted && $3 * $3 < 1e-8 && $4 == 0) }' || fail "Schmidt law: $(last even1)"

# The same law where a row in a thousand takes most of the steps, at the end of which births wait for a new tree.
sed 's/^box:.*/box: {x: 1000 pc, y: 1000 pc, z: 1000 pc}/; s/^start:.*/start: {generator: sedov, n: 1000, density: 0.0325 Msun\/pc^3, u: 45, energy: 1e51 erg, hot: 1}/
    s/250/50/; s/62.5/12.5/; s/^cooling.*//; s/rate: 0.1/rate: 0.3/' even.yml >hot.yml
expect_status 0 tephra run hot.yml --threads 1 --out hot1
expect_status 0 tephra run hot.yml --threads 2 --out hot2
same hot1/snapshot_004.hdf5 hot2/snapshot_004.hdf5
last hot1 | awk '{ left = $1 / ($1 + $2); k = 0.3 * 50 / 44.9; wanted = 1 - 1 / (1 + k / 2) ^ 2
    exit !(1 - left > 0.97 * wanted && 1 - left < 1.03 * wanted && $4 == 0) }' || fail "Schmidt law, steps of their own: $(last hot1)"

expect_status 0 tephra run ball.yml --threads 1 --out ball1
expect_status 0 tephra run ball.yml --threads 2 --out ball2
tephra info ball1/snapshot_021.hdf5 | grep -q '^star:' || fail "no stars in the collapse"
same ball1/snapshot_022.hdf5 ball2/snapshot_022.hdf5
expect_status 0 tephra run ball.yml --set time.end=0.21 --out half
expect_status 0 tephra run --restart half --set time.end=0.22
same ball1/snapshot_022.hdf5 half/snapshot_022.hdf5
if command -v mpirun >/dev/null && ! tephra --version | grep -q 'MPI *no'; then
    expect_status 0 mpirun -n 3 --oversubscribe tephra run ball.yml --threads 1 --out ranks
    same ball1/snapshot_022.hdf5 ranks/snapshot_022.hdf5
fi
last ball1 | awk '{ exit !($2 > 0 && $3 * $3 < 4e-6 && $4 == 0) }' || fail "books of the collapse: $(last ball1)"
# With one step for all nothing is left but what the collapse itself leaves: 3e-4 with stars and without, also if stars
# have a softening of their own (not booked, that would be 0.4 of the energy).
expect_status 0 tephra run ball.yml --set time.steps=common --set feedback=off --set gravity.softening_star=0.05 --out common
last common | awk '{ exit !($2 > 0 && $3 * $3 < 1e-6 && $4 == 0) }' || fail "books of stars: $(last common)"

expect_status 2 tephra check ball.yml --set sph.eos=isothermal --set sph.sound_speed=1
expect_text 'star_formation needs gas with an energy equation' err
finish
