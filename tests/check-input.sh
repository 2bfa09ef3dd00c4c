#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What the user gets wrong is told in one clear message with the right exit status, and nothing is
# left behind under a final name.
. "$TEPHRA_SOURCE/tests/lib.sh"

cat >good.yml <<'Y'
title: small Plummer sphere
units: {G: 1}
start: {generator: plummer, n: 200}
time: {end: 0.01}
output: {snapshot_every: 0.01}
gravity: {softening: 0.05}
Y

# edit LINE-PATTERN REPLACEMENT: the good scene with one line changed.
edit() { sed "s|$1|$2|" good.yml >bad.yml; }
# refuses TEXT...: the program ends with 2, says each text, and makes no run directory.
refuses() {
    rm -rf out
    expect_status 2 tephra run bad.yml --out out
    for text in "$@"; do expect_text "$text" err; done
    [ ! -e out ] || fail "a run directory was made for: $*"
}

edit 'gravity: .*' 'gravity: {softning: 0.05}';         refuses 'bad.yml:6' 'softning' 'softening'
edit 'gravity: .*' 'gravty: {softening: 0.05}';         refuses 'gravty' 'gravity'
edit 'softening: 0.05' 'softening: abc';                refuses 'bad.yml:6' 'abc'
edit 'softening: 0.05' 'softening:0.05';                refuses 'bad.yml:6' 'a blank is missing'
edit 'start: .*' 'start: {n: 9}';                       refuses 'bad.yml:3: start: give either'
edit 'gravity: .*' 'black_holes: {softening: 0.1}';     refuses 'bad.yml:6: block "black_holes" needs'
edit 'softening: 0.05' 'softening: 0.05x';              refuses '0.05x'
edit 'softening: 0.05' 'softening: 3 Msun';             refuses 'softening'
edit 'softening: 0.05' 'softening: -1';                 refuses 'softening' '-1'
edit 'softening: 0.05' 'softening: 0.05, accuracy: 2';  refuses 'accuracy' '0.3'
edit 'generator: plummer' 'generator: plumer';          refuses 'bad.yml:3' 'plumer' 'plummer'
edit 'n: 200' 'n: 2.5';                                 refuses 'start.n'
edit ', n: 200' '';                                     refuses 'start.n'
edit 'time: .*' '';                                     refuses 'time' 'end'
edit 'time: .*' 'time: {end: 0.01, integrator: leap}';  refuses 'bad.yml:4' 'leap'
edit 'output: .*' '';                                   refuses 'snapshot_every'
edit 'units: .*' 'units: {length: kpc, mass: Msun}';    refuses 'units'
edit 'gravity: .*' 'gravity: {softening: 0.05'; refuses 'bad.yml'
edit 'start: .*' 'start: {file: absent.hdf5}';          refuses 'absent.hdf5'
printf 'not HDF5 at all' >foreign.hdf5
edit 'start: .*' 'start: {file: foreign.hdf5}';         refuses 'foreign.hdf5'
printf 'gravity: {softning: 1}\nstart: {generatr: x}\n' >bad.yml; refuses 'softning' 'generatr'

expect_status 2 tephra run absent.yml;                  expect_text 'absent.yml' err
expect_status 2 tephra run;                             expect_text 'usage' err
expect_status 2 tephra rum good.yml;                    expect_text 'run' err
expect_status 2 tephra run good.yml --out out --set sph.neighbours=40; expect_text 'sph' err
expect_status 2 tephra run good.yml --out out --set gravity.softning=1; expect_text 'softening' err
expect_status 2 tephra run good.yml --out out --threads two; expect_text 'threads' err
expect_status 2 tephra run good.yml --out out --max-wall soon; expect_text 'max-wall' err
expect_status 2 tephra run --restart nowhere;           expect_text 'nowhere' err
[ ! -e out ] || fail 'a run directory was made'

expect_status 0 tephra run good.yml --out out
expect_status 2 tephra run good.yml --out out;          expect_text 'exists already' err
expect_status 0 tephra run good.yml --out out --force
expect_status 2 tephra run good.yml --out good.yml;     expect_text 'good.yml' err
expect_status 2 tephra run good.yml --out '';           expect_text 'names no folder' err
# Before the rows are read.
expect_status 2 tephra run good.yml --out out --set start.generator=none --set start.file=absent.hdf5 --set start.n=none
expect_text 'exists already' err
# A module without keys is in force and has no block.
expect_status 2 tephra check good.yml --set leapfrog={}; expect_text 'unknown block "leapfrog"' err
grep -q 'has a meaning only' err && fail "leapfrog is said not to be in force: $(cat err)"

# Usage on request; one key of a block.
for command in run check ics force-test info compare convert params chart; do
    expect_status 0 tephra $command --help;             expect_text "usage: tephra $command" out_text
    expect_status 0 tephra $command -h
    [ -s err ] && fail "$command -h: $(cat err)"
done
expect_status 0 tephra -h
for option in force restart threads device max-wall; do expect_text "[-]-$option" out_text; done
expect_status 0 tephra params sph.alpha;                expect_text '^  sph.alpha ' out_text
[ "$(grep -c '^  sph\.' out_text)" = 1 ] || fail "more than one key: $(cat out_text)"
expect_status 2 tephra params sph.alpah;                expect_text 'did you mean "alpha' err
expect_status 2 tephra params spj.alpha;                expect_text 'no block' err

# A file cut short, and rows that cannot be.
cp out/snapshot_000.hdf5 whole.hdf5
cp out/checkpoint.hdf5 saved.hdf5
edit 'start: .*' 'start: {file: saved.hdf5}';           refuses 'saved.hdf5 is a checkpoint' '--restart'
expect_status 2 tephra convert saved.hdf5 saved.csv;    expect_text 'is a checkpoint' err
expect_status 2 tephra force-test whole.hdf5 --set sph={}; expect_text 'gravity and units only' err
head -c 3000 whole.hdf5 >cut.hdf5
edit 'start: .*' 'start: {file: cut.hdf5}';             refuses 'cut.hdf5'

# damage NAME STATEMENTS: NAME.hdf5 is the run's first snapshot after python's statements on the file f.
for python in python3 /usr/bin/python3; do "$python" -c 'import h5py' 2>/dev/null && break; python=; done
damage() {
    cp whole.hdf5 "$1.hdf5"
    "$python" - "$1.hdf5" "$2" <<'P'
import sys
import h5py
import numpy as np
with h5py.File(sys.argv[1], "r+") as f:
    rows = f["PartType1"]
    exec(sys.argv[2])
P
    sed "s|start: .*|start: {file: $1.hdf5}|" good.yml >bad.yml
}
if [ "$python" ]; then
    damage nan 'rows["Velocities"][7, 1] = np.nan';           refuses 'dark particle 8 has Velocities = nan' 'correct it'
    damage negative 'rows["Masses"][3] = -1';                 refuses 'dark particle 4 has Masses = -1'
    damage far 'rows["Coordinates"][5, 0] = 1e200';           refuses 'particle 6 has Coordinates = 1e+200' 'larger'
    damage twice 'rows["ParticleIDs"][9] = 1';                refuses 'the id 1 is used twice'
    damage weightless 'rows["Masses"][:] = 0';                refuses 'all masses are 0'
    damage headless 'del f["Header"]';                         refuses 'headless.hdf5 has no group Header'
    damage less 'f["Header"].attrs["NumPart_ThisFile"] = [9, 200, 0, 0, 0, 0]'; refuses '9 rows of PartType0' 'no such group' 'write it anew'
    damage fewer 'f["Header"].attrs["NumPart_ThisFile"] = [0, 300, 0, 0, 0, 0]'; refuses '300 rows of PartType1'
    damage solid 'del rows["Coordinates"]; rows["Coordinates"] = np.zeros((5, 4, 3))'; refuses 'not a table of rows'
    damage cosmic 'f.create_group("Cosmology").attrs["Cosmological run"] = 1'; refuses 'cosmological'
    damage shifted 'f["Header"].attrs["Redshift"] = 2.0';      refuses 'cosmological'
    damage late 'f["Header"].attrs["Time"] = 5.0';             refuses 'of t = 5 already'
    damage timeless 'f["Header"].attrs["Time"] = np.nan';      refuses 'its Time is nan'
    damage unitless 'f["Units"].attrs["UnitLength_in_cm"] = 0.0'; refuses 'unit of length is 0'
    damage unknown 'rows.attrs["species"] = "gaz"';            refuses 'species = "gaz": gas, cloud, star or dark'
    damage rounded 'n = rows["ParticleIDs"][:]; del rows["ParticleIDs"]; rows["ParticleIDs"] = n.astype("f4")'
    refuses 'ParticleIDs are not whole numbers but floats'
    damage hubble 'f["Header"].attrs["HubbleParam"] = 0.0'
    expect_status 0 tephra run bad.yml --out hubble
    damage kpc 'f["Units"].attrs["units"] = "kpc"; f["Units"].attrs["UnitLength_in_cm"] = 3e21'
    expect_status 0 tephra run bad.yml --out kpc;              expect_text 'kpc.hdf5 has units' err
    damage wide 'rows["Pair"] = np.zeros((200, 2)); f.create_group("PartType4")["Coordinates"] = np.zeros((0, 3))'
    expect_status 0 tephra info wide.hdf5;                     expect_text '^  Pair  *d x2 ' out_text
    expect_text '^  Coordinates  *d x3  *none' out_text
    damage nameless 'del rows["ParticleIDs"]'
    expect_status 0 tephra run bad.yml --out nameless;         expect_text 'numbered' err
    # A checkpoint that is damaged names the one before it.
    cp good.yml two.yml
    expect_status 0 tephra run two.yml --out two --set time.end=0.02
    head -c 3000 two/checkpoint.hdf5 >cut && cp cut two/checkpoint.hdf5
    expect_status 2 tephra run --restart two;                  expect_text 'checkpoint.previous.hdf5' err
fi

# Keys that mean nothing in a scene, and a generator named twice. used.yml, which says every key, is none of these.
printf 'units: {G: 1}\nstart: {generator: evrard, n: 200}\ntime: {end: 0.01}\noutput: {snapshot_every: 0.01}\ngravity: {softening: 0.05}\nsph: {}\n' >gas.yml
# meaningless KEY=VALUE NEEDS SETTING...
meaningless() {
    key=$1; needs=$2; shift 2
    set=; for s in "$@"; do set="$set --set $s"; done
    expect_status 2 tephra check gas.yml $set --set "sph.$key"; expect_text "sph.${key%%=*} has a meaning only with $needs" err
}
meaningless courant=0.2 time.criterion time.criterion=classic
meaningless acceleration=0.2 time.criterion time.criterion=classic
meaningless alpha_min=0.1 sph.strength
meaningless balsara_epsilon=0.1 sph.balsara sph.balsara=off
meaningless gamma=1.4 sph.eos sph.eos=isothermal sph.sound_speed=1
expect_status 0 tephra run gas.yml --set time.criterion=classic --set sph.balsara=off --out classic
expect_status 0 tephra check classic/used.yml
expect_status 2 tephra ics evrard n=10 generator=plummer -o x.hdf5; expect_text 'generator=plummer: the generator is named once' err

# An end before the start, with its place.
edit 'time: .*' 'time: {end: -3}';                             refuses 'bad.yml:4: time.end = -3' 'later'

# Places where nothing can be made, and full ones.
expect_status 2 tephra run good.yml --out /proc/out;           expect_text '/proc/out' err
expect_status 2 tephra ics evrard n=10 -o /proc/out.hdf5;      expect_text '/proc/out.hdf5' err
expect_status 2 tephra ics evrard n=10 -o classic;             expect_text 'folder' err
if [ -w /dev/full ]; then
    tephra params >/dev/full 2>err; got=$?
    [ $got -eq 5 ] || fail "standard output is full: exit status $got, not 5"
    expect_text 'standard output' err
fi
# A file over the limit fails as on a full disk: its text is no part of a whole file, and what came before stays.
( ulimit -f 40 && tephra run good.yml --out full --set start.n=2000 >/dev/null 2>err ); got=$?
[ $got -eq 5 ] || fail "a full disk: exit status $got, not 5"
expect_text 'snapshot_000.hdf5' err
[ ! -e full/snapshot_000.hdf5 ] || fail "half a snapshot stands under its name"
[ -s full/used.yml ] || fail "a full disk took used.yml"
expect_status 0 tephra run good.yml --out full --set start.n=2000 --force
ls full | grep -q tmp && fail "--force left an unfinished file"
( ulimit -f 0 && tephra run good.yml --out fuller >/dev/null 2>&1 ); got=$?
[ $got -eq 5 ] || fail "a full disk at the start: exit status $got, not 5"
expect_status 0 tephra run good.yml --out fuller
# The last checkpoint is told where a later write fails.
expect_status 0 tephra run good.yml --out later --set start.n=2000
( ulimit -f 40 && tephra run --restart later --set time.end=0.02 >/dev/null 2>err ); got=$?
[ $got -eq 5 ] || fail "a full disk after a restart: exit status $got, not 5"
expect_text 'tephra run --restart later' err

# Units in which single precision does not hold the gas; others give the same energies.
cat >cloud.yml <<'Y'
units: {length: pc, mass: Msun, velocity: km/s}
start: {generator: evrard, n: 300, mass: 2000 Msun, radius: 3 pc}
time: {end: 0.1 Myr}
output: {snapshot_every: 0.1 Myr, energy_every: 6.25 kyr}
gravity: {softening: 0.05 pc}
sph: {}
Y
sed 's/units: .*/units: {length: cm, mass: g, velocity: cm\/s}/' cloud.yml >cgs.yml
expect_status 2 tephra run cgs.yml;                            expect_text 'does not hold their forces' err
sed 's/units: .*/units: {length: au, mass: 1e30 kg, velocity: m\/s}/' cloud.yml >au.yml
for s in cloud au; do expect_status 0 tephra run $s.yml --out $s; done
[ "$python" ] && { "$python" - <<'P' || fail "the units change the run"; }
import h5py, numpy as np
a, b = (h5py.File(f"{s}/snapshot_001.hdf5")["PartType0"] for s in ("cloud", "au"))
for name, limit in (("Coordinates", 1e-3), ("Density", 1e-2), ("InternalEnergy", 1e-2)):   # rungs may fall otherwise
    x, y = a[name][:].astype(float), b[name][:].astype(float)
    assert np.abs(x - y).max() <= limit * np.abs(x).max(), (name, np.abs(x - y).max() / np.abs(x).max())
P

# Gas that nothing presses, and gas physics without gas: a warning each.
expect_status 0 tephra check good.yml --set start.generator=evrard; expect_text 'they move as dust' err
expect_status 0 tephra check good.yml --set sph={};            expect_text 'there is no gas' err
expect_status 0 tephra check good.yml --set gravity.softening=0; expect_text 'gravity.softening of dark is 0' err
expect_status 0 tephra check good.yml --set gravity.accuracy=3e-7; expect_text 'beyond single precision' err
for beyond in 'tree opening_angle=0.9 0.8' 'fmm tolerance=0.1 1e-2'; do
    set -- $beyond
    expect_status 0 tephra check good.yml --set gravity.solver=$1 --set gravity.$2; expect_text 'err by up to 80 %' err
    expect_status 0 tephra check good.yml --set gravity.solver=$1 --set "gravity.${2%%=*}=$3"
    grep -q 'err by up to' err && fail "$1 $2: a warning within the boundary"
done
# Steps beyond what the integrator holds: omega dt = sqrt 2 of pec, 2 of leapfrog.
expect_status 0 tephra check good.yml --set time.integrator=pec --set gravity.time_step=1.1
expect_text 'omega dt = 1.56; this integrator is stable up to 1.41' err
for within in 'pec 0.99' 'leapfrog 1.1'; do
    set -- $within
    expect_status 0 tephra check good.yml --set time.integrator=$1 --set gravity.time_step=$2
    grep -q 'omega dt' err && fail "$1 time_step=$2: a warning within the boundary"
done
finish
