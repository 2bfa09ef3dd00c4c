#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A run's promises: bit for bit the same on 1 and 2 threads, when continued from a scheduled
# checkpoint and from its used.yml; stops on request; columns of modules that a scene does not name
# do not exist.
. "$TEPHRA_SOURCE/tests/lib.sh"

scene=$TEPHRA_SOURCE/ics/evrard.yml
small="--set start.n=2000 --set time.end=0.4 --set output.snapshot_every=0.1 --set output.picture_every=0.2"

expect_status 0 tephra run "$scene" $small --threads 1 --out one
expect_status 0 tephra run "$scene" $small --threads 2 --out two
for k in 0 1 2 3 4; do same one/snapshot_00$k.hdf5 two/snapshot_00$k.hdf5; done
cut -d, -f1-10 one/energy.csv >a; cut -d, -f1-10 two/energy.csv >b
cmp -s a b || fail "energies differ on 1 and 2 threads"

# What limits the steps, and what steps of their own save: told as measured, beside the ideal.
expect_text '^smallest step .* by sph.courant: gas particle [0-9]*, rho .*, h .*, u ' one/log.txt
awk '/^steps of their own: / { taken = $5; ideal = $17 } END { exit !(taken > 1.2 && ideal >= taken && ideal < 2 * taken) }' one/log.txt ||
    fail "no sensible gain of steps: $(tail -n 1 one/log.txt)"
# Two bodies take the same steps, common or not.
printf 'units: {G: 1}\nstart: {generator: kepler, n: 2}\ntime: {end: 7}\noutput: {snapshot_every: 1}\ngravity: {softening: 0}\n' >kepler.yml
expect_status 0 tephra run kepler.yml
expect_text '^steps of their own: 1.00 times' kepler/log.txt
expect_status 0 tephra run "$scene" --set start.n=500 --set time.end=0.1 --set sph.acceleration=0.01 --out slow
expect_text '^smallest step .* by sph.acceleration: ' slow/log.txt

# What a run leaves.
for f in used.yml log.txt energy.csv profile.csv checkpoint.hdf5 picture_000.png; do
    [ -s one/$f ] || fail "$f is not there"
done
ls one | grep -q tmp && fail "temporary files are left"

# used.yml reproduces the run.
expect_status 0 tephra run one/used.yml --out again
same one/snapshot_004.hdf5 again/snapshot_004.hdf5

# So it does, and a restart, for a run from a file.
{ printf 'title: from a file\nstart: {file: %s/one/snapshot_001.hdf5}\n' "$PWD"
  printf 'time: {end: 0.2}\noutput: {snapshot_every: 0.05}\nunits: {G: 1}\ngravity: {softening: 0.01}\nsph: {}\n'; } >file.yml
expect_status 0 tephra run file.yml --out file
expect_status 0 tephra run file/used.yml --out file-again
same file/snapshot_002.hdf5 file-again/snapshot_002.hdf5
expect_status 0 tephra run file.yml --set time.end=0.15 --out file-half
expect_status 0 tephra run --restart file-half --set time.end=0.2
same file/snapshot_002.hdf5 file-half/snapshot_002.hdf5

# To half time, then on.
expect_status 0 tephra run "$scene" $small --set time.end=0.2 --out half
printf '0.' >>half/energy.csv       # as a machine that stops leaves it
expect_status 0 tephra run --restart half --set time.end=0.4
same one/snapshot_004.hdf5 half/snapshot_004.hdf5
cut -d, -f1-10 half/energy.csv >b
cmp -s a b || fail "energies differ after a restart"
awk '/updates, .* CPU s/ { all[++n] = $3 } /^[0-9]+ of the updates since/ { since = $1 }
     END { exit !(n == 2 && since > 0 && since == all[2] - all[1]) }' half/log.txt ||
    fail "updates since the restart: $(grep 'of the updates since' half/log.txt)"
expect_status 0 tephra run --restart half
expect_text 'nothing to do' err

# The same with the other equations of the gas; a preset yields to what the scene says, and check and used.yml tell.
modern="--set sph.preset=modern --set sph.count=smooth --set sph.grad_h=on --set sph.equation=entropy --set time.end=0.2"
expect_status 0 tephra run "$scene" $small $modern --threads 1 --out modern
expect_status 0 tephra run "$scene" $small $modern --set time.end=0.1 --threads 2 --out modern_half
expect_status 0 tephra run --restart modern_half --set time.end=0.2 --threads 2
same modern/snapshot_002.hdf5 modern_half/snapshot_002.hdf5
tephra compare one/snapshot_002.hdf5 modern/snapshot_002.hdf5 >out_text 2>&1 && fail "preset modern changes nothing"
grep -q 'strength: shocks' modern/used.yml || fail "used.yml does not resolve the preset"
expect_status 0 tephra check "$scene" $small --set sph.preset=modern --set sph.neighbours=60
grep -q 'strength: shocks' out_text && grep -q 'neighbours: 60' out_text || fail "check does not resolve the preset"
expect_status 0 tephra check "$scene" --set start.n=40;                      expect_text 'fewer than the 50 neighbours' err
expect_status 0 tephra check "$scene" $small --set sph.h_min=0.1;            expect_text 'rows stand there at the start' err
expect_status 0 tephra check "$scene" $small --set sph.neighbours=64;        expect_text 'particles pair' err
expect_status 0 tephra check "$scene" $small --set sph.neighbours=64 --set sph.kernel=wendland_c2
grep -q 'particles pair' err && fail "a kernel that does not pair is warned of"
sedov=$TEPHRA_SOURCE/ics/sedov.yml
expect_status 0 tephra check "$sedov" --set sph.step_ratio=8;                 expect_text 'gas that sleeps' err
expect_status 2 tephra check "$sedov" --set sph.step_ratio=3;                 expect_text 'not a power of two' err
expect_status 2 tephra check "$sedov" --set sph.step_ratio=2 --set time.steps=common; expect_text 'has a meaning only' err
expect_status 0 tephra check "$sedov" --set start.hot=1;                      expect_text 'one row of gas holds 100 %' err
expect_status 0 tephra check "$sedov" --set sph.conduction=1;                 expect_text 'energy errors of 1 %' err
expect_status 0 tephra check "$TEPHRA_SOURCE/ics/disc.yml" --set sph.balsara=off; expect_text 'this gas rotates' err
expect_status 0 tephra check "$sedov" --set sph.balsara=off
grep -q 'this gas rotates' err && fail "gas at rest is taken for a disc"
for within in start.hot=32 'start.hot=1 --set sph.conduction=0.1'; do
    expect_status 0 tephra check "$sedov" --set $within
    grep -q 'one row of gas' err && fail "$within: a warning within the boundary"
done
expect_status 2 tephra check "$TEPHRA_SOURCE/ics/slab_shock.yml" --set sph.conduction=1; expect_text 'sph.conduction has a meaning' err
expect_status 2 tephra check "$scene" --set sph.equation=entropy;  expect_text 'grad_h' err
expect_status 2 tephra check "$scene" --set sph.grad_h=on;         expect_text 'count' err
expect_status 2 tephra check "$scene" --set sph.strength=shocks --set sph.alpha_min=3; expect_text 'alpha_min' err

# used.yml holds the preset's own default of a key that the scene's choice leaves without meaning, and can be run again.
still="--set sph.preset=modern --set sph.strength=constant"
expect_status 0 tephra run "$scene" $small $still --set time.end=0.1 --out still
expect_status 0 tephra check still/used.yml
expect_status 0 tephra run --restart still --set time.end=0.2
expect_status 2 tephra check "$scene" $small $still --set sph.alpha_min=0.3; expect_text 'alpha_min has a meaning' err

# A cadence beyond the end of the run, by any factor: a snapshot at its start and one at its end.
expect_status 0 tephra run "$scene" --set start.n=500 --set time.end=0.1 --set time.dt_max=0.01 --set output.snapshot_every=1e12 \
    --set output.picture_every=1e12 --out rare
[ "$(ls rare | grep -c snapshot_)" -eq 2 ] && [ "$(ls rare | grep -c picture_)" -eq 2 ] || fail "snapshots of a rare cadence: $(ls rare)"

# What was changed in used.yml by hand would be another run.
cp still/used.yml saved.yml
for change in 'softening: [^ ]*/softening: 0.5/softening: .*0.5' 'n: 2000/n: 3000/start.n: 2000.*3000' \
              'G: 1$/G: 2/units.G: 1,.* 2' 'strength: constant/strength: shocks/sph.strength: constant'; do
    from=${change%%/*}; rest=${change#*/}; to=${rest%%/*}; words=${rest#*/}
    sed "s/^  $from/  $to/" saved.yml >still/used.yml
    cmp -s saved.yml still/used.yml && fail "used.yml has no $from"
    expect_status 2 tephra run --restart still --set time.end=0.3
    expect_text "$words.* may not change when a run is continued" err
done
sed 's/^  courant: .*/  courant: 0.2/' saved.yml >still/used.yml
expect_status 0 tephra run --restart still --set time.end=0.3

# A continued run keeps what it is made of; what may change is kept in used.yml.
expect_status 2 tephra run --restart half --set gravity.softening=0.5; expect_text 'softening' err
expect_status 2 tephra run --restart half --set sph=off;               expect_text 'sph' err
expect_status 2 tephra run --restart half --out other;                 expect_text 'restart' err
expect_status 0 tephra run --restart half --set time.end=0.05;         expect_text 'nothing to do' err
grep -q 'end: 0.4' half/used.yml || fail "used.yml does not hold what a restart has changed"

# --force takes away what a run writes, nothing else, and never what it begins from.
echo mine >half/mine.csv
cat >from-file.yml <<Y
units: {G: 1}
start: {file: half/snapshot_000.hdf5}
time: {end: 0.1}
output: {snapshot_every: 0.1}
gravity: {softening: 0.01}
sph: {}
Y
expect_status 2 tephra run from-file.yml --out half --force
expect_text 'snapshot_000.hdf5' err
expect_status 0 tephra convert half/snapshot_000.hdf5 elsewhere.hdf5
sed 's/^start: .*/start: {generator: combine, first: elsewhere.hdf5, second: elsewhere.hdf5, separation: 5, pericentre: 1}/' from-file.yml >combine.yml
for pair in 'elsewhere half/snapshot_000 second' 'half/snapshot_000 elsewhere first'; do
    set -- $pair
    expect_status 2 tephra run combine.yml --set start.first=$1.hdf5 --set start.second=$2.hdf5 --out half --force
    expect_text "start.$3 lies in the run directory" err
done
ln -s half/snapshot_000.hdf5 link.hdf5
expect_status 2 tephra run from-file.yml --set start.file=link.hdf5 --out half --force
for f in snapshot_000_map.png plan_001.csv snapshot_000.txt; do echo mine >half/$f; done
printf 't [Gyr],a\n9,1\n' >half/lagrange.csv
for f in snapshot_007.hdf5 phase_007.csv phase_007.png clumps_007.csv cloud_masses_1007.csv picture_007.png.tmp checkpoint.previous.hdf5; do
    echo old >half/$f
done
mkdir q1 'q[1]'
cp half/used.yml q1
expect_status 0 tephra run "$scene" --set start.n=500 --set time.end=0.01 --out 'q[1]' --force
[ -s q1/used.yml ] || fail "--force took files of another folder, whose name its own matches as a pattern"
expect_status 0 tephra run "$scene" $small --set time.end=0.1 --out half --force
for f in mine.csv snapshot_000_map.png plan_001.csv snapshot_000.txt; do [ -s half/$f ] || fail "--force took a file of the user's: $f"; done
ls half | grep -e 007 -e lagrange -e previous && fail "--force left files of the run before"
[ "$(sed -n 2p half/energy.csv | cut -d, -f1)" = 0 ] && [ "$(grep -c '^0,' half/energy.csv)" -eq 1 ] ||
    fail "energy.csv was appended to after --force"

# Numbers that fail: told once, in the log too, with a last snapshot.
expect_status 3 tephra run "$scene" $small --set output.energy_limit=1e-12 --out failed
[ "$(grep -c 'energy_limit' err)" -eq 1 ] || fail "the reason is told $(grep -c 'energy_limit' err) times"
expect_text 'energy_limit' failed/log.txt
# What lies beside a snapshot stays as it was then, and the last state has a snapshot alone.
expect_status 0 tephra run "$scene" $small --set clumps={} --set clumps.density=1 --set clumps.least=1 --set time.end=0.1 --out beside
expect_status 3 tephra run "$scene" $small --set clumps={} --set clumps.density=1 --set clumps.least=1 --set output.energy_limit=1e-12 --out besides
cmp -s beside/clumps_000.csv besides/clumps_000.csv || fail "a step that failed changed the clumps beside the last snapshot"
[ "$(ls besides | grep -c snapshot_)" -eq 2 ] && [ "$(ls besides | grep -c clumps_)" -eq 1 ] || fail "after a failure: $(ls besides)"
ls failed/snapshot_*.hdf5 >/dev/null || fail "no last snapshot"

# A force beyond what a float holds: the particle is named, and the last state is kept.
expect_status 3 tephra run "$TEPHRA_SOURCE/ics/plummer.yml" --set start.n=300 --set start.mass=1e30 --set start.radius=1e-6 \
    --set gravity.softening=1e-9 --out infinite
expect_text 'dark particle [0-9]* at t = 0: .* is not finite' err
ls infinite/snapshot_*.hdf5 >/dev/null || fail "no last snapshot after an infinite force"

# Stopped in the midst of it, then on: the same physics, not the same bits.
tephra run "$scene" $small --out stopped >/dev/null 2>&1 &
pid=$!
while [ ! -s stopped/snapshot_001.hdf5 ] && kill -0 $pid 2>/dev/null; do sleep 0.05; done
kill -TERM $pid
wait $pid; status=$?
if [ $status -eq 4 ]; then
    awk '/^steps of their own: / { taken = $5; ideal = $17 } END { exit !(taken > 1 && ideal >= taken && ideal < 2 * taken) }' stopped/log.txt ||
        fail "no sensible gain of steps after a stop: $(grep '^steps of their own' stopped/log.txt)"
    expect_status 0 tephra run --restart stopped
    tail -n 1 one/energy.csv | cut -d, -f4-6 >a; tail -n 1 stopped/energy.csv | cut -d, -f4-6 >b
    paste -d, a b | awk -F, '{ for (i = 1; i <= 3; i++) { d = $i - $(i + 3); if (d * d > 1e-6 * $i * $i) exit 1 } }' ||
        fail "energies differ after a stop: $(cat a) and $(cat b)"
else
    fail "SIGTERM: exit status $status, not 4"
fi
# So do SIGUSR1 and a file `stop`; SIGUSR2 asks for a snapshot and the run goes on.
# ask FOLDER COMMAND...: a run there, and the command once its first snapshot stands; the status of the run in $status.
ask() {
    folder=$1; shift
    tephra run "$scene" $small --set output.snapshot_every=0.2 --set output.energy_every=0.0125 --set clumps={} --set clumps.density=1 \
        --set clumps.least=1 --out $folder >/dev/null 2>&1 &
    pid=$!
    while [ ! -s $folder/snapshot_000.hdf5 ] && kill -0 $pid 2>/dev/null; do sleep 0.02; done
    "$@"
    wait $pid; status=$?
}
by_signal() { kill -$1 $pid; }
ask usr1 by_signal USR1
[ $status -eq 4 ] && [ -s usr1/checkpoint.hdf5 ] || fail "SIGUSR1: exit status $status, not 4, or no checkpoint"
ask by_file touch by_file/stop
[ $status -eq 4 ] && [ -s by_file/checkpoint.hdf5 ] || fail "a file stop: exit status $status, not 4, or no checkpoint"
[ ! -e by_file/stop ] || fail "the file stop is still there"
ask usr2 by_signal USR2
[ $status -eq 0 ] || fail "SIGUSR2: exit status $status, not 0"
[ -s usr2/snapshot_003.hdf5 ] || fail "SIGUSR2 gave no snapshot: $(ls usr2)"
tephra info usr2/snapshot_001.hdf5 | awk '$1 == "time" && NF == 2 { t = $2 } END { exit !(t > 0 && t < 0.2) }' ||
    fail "the snapshot asked for is not the first"
for k in 0 1 2 3; do [ -s usr2/clumps_00$k.csv ] || fail "no clumps beside snapshot $k: $(ls usr2)"; done
tephra run "$scene" $small --out wall --max-wall 0s >/dev/null 2>&1
[ $? -eq 4 ] || fail "--max-wall: exit status is not 4"

# A column that no module asked for is NULL, and no file has it: not the smoothing length of dark rows, nor the temperature or
# the metals of this gas; what was asked for is there.
tephra info one/snapshot_004.hdf5 >out_text
for set in Coordinates InternalEnergy SmoothingLength Density; do expect_text "$set" out_text; done
for set in Metallicity OxygenFraction StellarFormationTime InitialMass Temperature; do
    grep -q "$set" out_text && fail "a run that does not model $set has it in its files"
done
expect_status 0 tephra run "$TEPHRA_SOURCE/ics/plummer.yml" --set start.n=100 --set time.end=0.01 --out bare
tephra info bare/snapshot_000.hdf5 >out_text
expect_text Coordinates out_text
for set in InternalEnergy SmoothingLength Density; do
    grep -q "$set" out_text && fail "a scene without sph has $set in its files"
done

# A scene without gas has neither its columns nor its cost.
expect_status 0 tephra check "$TEPHRA_SOURCE/ics/plummer.yml" --set start.n=500
grep -qw 'sph' out_text && fail "a scene without sph lists it"
grep -Eq ' (h|rho|u)( |$)' out_text && fail "a scene without sph has its columns"
finish
