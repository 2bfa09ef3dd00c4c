#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# tephra chart: small charts with their CSV and pictures; what the command refuses; integrators compared
# through the very driver of a run.
. "$TEPHRA_SOURCE/tests/lib.sh"

expect_status 0 tephra chart
expect_text '  time ' out_text
expect_status 0 tephra params chart.time
expect_text 'chart.time_step' out_text
expect_text 'chart.repeats' out_text
expect_status 2 tephra chart tme;             expect_text 'did you mean "time"' err
expect_status 2 tephra chart step m=3;        expect_text 'chart.m: unknown key (did you mean "n"?)' err
expect_status 2 tephra chart step n=1e3,10x;  expect_text 'chart.n = 1e3,10x: unknown unit "x"' err
expect_status 2 tephra chart step n=2;        expect_text 'chart.n = 2: must lie in 16' err
expect_status 2 tephra chart step a.png;      expect_text 'the picture lies beside it' err
expect_status 2 tephra chart step no/a.csv;   expect_text 'no/a.csv: cannot be written' err
[ -z "$(ls | grep -v -e out_text -e err)" ] || fail "a mistake leaves files: $(ls)"

expect_status 0 tephra chart step n=500,4000 repeats=2
[ "$(head -c 4 step.png | tail -c 3)" = PNG ] || fail "step.png is no picture"
expect_text '^# program: tephra ' step.csv
expect_text '^#   n: 500, 4000$' step.csv
expect_text '^n,part,cpu \[s\],cpu_per_row \[microseconds\],source$' step.csv
awk -F, '$2 == "sum" { sum = $3 } $2 != "sum" && $1 == 4000 { parts += $3 }
         END { exit !(sum > 0 && (parts / sum - 1) ^ 2 < 1e-5) }' step.csv || fail "the parts of a step are not its sum"
[ ! -e step.csv.tmp ] || fail "step.csv.tmp is left"
expect_status 2 tephra chart step n=500;      expect_text 'step.csv: exists already (--force' err
expect_status 0 tephra chart step n=500 --force

# Cooling over a cooling time: exact within 1e-5 (heated 1e-3), sub-steps of a hundredth within 1e-2; a backward Euler
# step finds the wrong root.
expect_status 0 tephra chart cooling repeats=1 n=50 step=1 part=0.01
awk -F, '/^(cooling|heated),/ { error[$1 $2] = $6 } END { exit !(error["coolingexact"] < 1e-5 && error["heatedexact"] < 1.5e-3 &&
         error["coolingsub-steps 0.01"] < 0.02 && error["coolingbackward Euler"] > 1) }' cooling.csv || fail "unexpected: $(cat cooling.csv)"

# A supernova among rows of 16 Msun gives nearly twice its momentum, among rows of 128 a sixth of it.
expect_status 0 tephra chart supernova repeats=1 density=1 row=16,128 --threads 1
awk -F, '$2 == 16 { over = $5 } $2 == 128 { lost = $5 } END { exit !(over > 1.6 && over < 2.1 && lost > 0.1 && lost < 0.25) }' \
    supernova.csv || fail "unexpected: $(cat supernova.csv)"

# Ten orbits, e = 0.5, some 770 steps: leapfrog keeps the energy better than pec by far.
expect_status 0 tephra chart time orbit.csv repeats=1 n_collapse=0 n_evrard=0 eccentricity=0.5 time_step=0.1,0.2
awk -F, '$4 == 2 { error[$2] = $6; forces[$2] = $5 }
         END { twice = forces["pec twice"] > 1.5 * forces["pec"]
               exit !(twice && error["leapfrog"] < 5e-3 && error["pec"] > 0.1 && error["pec twice"] > 0.06) }' orbit.csv || fail "unexpected: $(cat orbit.csv)"

# More rows, less error; steps of their own are fewer; what is no key is told as in a scene.
expect_status 0 tephra chart sph repeats=1 n_sod=0 n_noh=0 n_wave=0 n_sedov=512 refine=1,8 neighbours=50 courant=0.3 \
    acceleration=0.25 alpha=1 variants='balsara=off count=smooth+alpha=0.8'
awk -F, '$2 == "n" { error[$3] = $7 } $2 == "steps" { common = $9 } $3 == "0.3" { own = $9 } $2 == "variant" { n++ }
         END { exit !(error[8] < 0.75 * error[1] && own < 0.7 * common && n == 2) }' sph.csv || fail "unexpected: $(cat sph.csv)"
expect_status 2 tephra chart sph other.csv repeats=1 n_sod=0 n_noh=0 n_wave=0 n_sedov=64 variants=balsra=off
expect_text 'did you mean "balsara"' err

# Forces: a closer opening costs less error; peers stand beside the shipped size only; groups share lists.
expect_status 0 tephra chart gravity forces.csv n=3000 set=plummer repeats=1 sample=500 tolerance=1e-2,1e-5 angle=0.9,0.5 accuracy=1e-3
awk -F, '$1 == "plummer" { rms[$3] = $12; p99[$3] = $14 }
         END { exit !(rms["fmm order 5 1e-05"] < 0.1 * rms["fmm order 5 0.01"] && rms["tree order 2 0.5"] < rms["tree order 1 0.9"]) }' forces.csv ||
    fail "unexpected: $(cat forces.csv)"
awk -F, '$3 ~ /by accuracy/ { seen = 1; if (!($14 <= 1e-3)) exit 1 } END { exit !seen }' forces.csv || fail "the accuracy asked is missed"
grep -q FDPS forces.csv && fail "peers beside another number of particles"
expect_status 0 tephra chart group group.csv n=3000 group=20,2000 repeats=1
awk -F, '$1 == "plummer" { pairs[$2] = $6 } END { exit !(pairs[2000] > 3 * pairs[20]) }' group.csv || fail "unexpected: $(cat group.csv)"
finish
