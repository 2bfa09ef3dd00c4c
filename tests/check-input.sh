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
edit 'softening: 0.05' 'softening: 0.05x';              refuses '0.05x'
edit 'softening: 0.05' 'softening: 3 Msun';             refuses 'softening'
edit 'softening: 0.05' 'softening: -1';                 refuses 'softening' '-1'
edit 'softening: 0.05' 'softening: 0.05, accuracy: 2';  refuses 'accuracy' '0.3'
edit 'generator: plummer' 'generator: plumer';          refuses 'plumer' 'plummer'
edit 'n: 200' 'n: 2.5';                                 refuses 'start.n'
edit ', n: 200' '';                                     refuses 'start.n'
edit 'time: .*' '';                                     refuses 'time' 'end'
edit 'time: .*' 'time: {end: 0.01, integrator: leap}';  refuses 'leap'
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

# A file cut short, and rows that cannot be.
head -c 3000 out/snapshot_000.hdf5 >cut.hdf5
edit 'start: .*' 'start: {file: cut.hdf5}';             refuses 'cut.hdf5'
finish
