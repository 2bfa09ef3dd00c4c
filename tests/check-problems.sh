#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Small runs of the problems with exact solutions against gates (tests/scenes/validate.py); skipped where
# Python lacks numpy, h5py or matplotlib.
. "$TEPHRA_SOURCE/tests/lib.sh"
# What a box refuses.
expect_status 2 tephra run "$TEPHRA_SOURCE/ics/evrard.yml" --set box={} --set box.x=1
expect_text 'block "gravity" knows open space only' err
expect_status 2 tephra run "$TEPHRA_SOURCE/ics/sod.yml" --set box=off
expect_text 'give box.y' err

# A file's BoxSize is used by an empty block; a sphere of the box's own kind is read back the same.
expect_status 0 tephra ics sedov n=500 box.x=2 box.y=2 box.z=2 -o sedov.hdf5
printf 'units: {G: 1}\nbox: {}\nstart: {file: sedov.hdf5}\ntime: {end: 0.001}\noutput: {snapshot_every: 0.001}\nsph: {}\n' >file.yml
expect_status 0 tephra run file.yml --out file
grep -q 'x: 2' file/used.yml || fail "BoxSize of the file is not used"

for python in python3 /usr/bin/python3; do
    $python -c 'import numpy, h5py, matplotlib' 2>/dev/null && break
done
$python "$TEPHRA_SOURCE/tests/scenes/validate.py" --gates --out runs; status=$?
[ $status -eq 77 ] && [ $failures -eq 0 ] && exit 77
[ $status -eq 0 ] || fail "a problem is beyond its gate"
finish
