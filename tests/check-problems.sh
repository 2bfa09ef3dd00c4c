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

# A tube that moves at 800 times the speed of sound: the same steps, the same gas. (h/|v| of `classic` shortens them.)
tube="$TEPHRA_SOURCE/ics/sod.yml --set start.n=1000 --set time.end=0.02 --set output.snapshot_every=0.02"
for v in 0 1000; do
    expect_status 0 tephra run $tube --set start.velocity_left=$v --set start.velocity_right=$v --out boost_$v
    sed -n 's/.* \([0-9]*\) updates,.*/\1/p' boost_$v/log.txt >updates_$v
done
awk 'NR == 1 { rest = $1 } END { if ($1 < 0.98 * rest || $1 > 1.02 * rest) { print rest, $1; exit 1 } }' updates_0 updates_1000 ||
    fail "a boost changes the steps"
tephra check $tube --set start.velocity_left=1000 --set start.velocity_right=1000 --set time.criterion=classic >out_text 2>err
expect_text 'the gas moves as a whole' err
if $python -c 'import h5py' 2>/dev/null; then
    $python - <<'P' || fail "a boost changes the gas"
import h5py
import numpy as np
rest, boost = (h5py.File(f"boost_{v}/snapshot_001.hdf5")["PartType0"] for v in (0, 1000))
for name, limit in (("Density", 1e-3), ("InternalEnergy", 1e-3)):
    x, y = rest[name][:].astype(float), boost[name][:].astype(float)
    assert np.abs(x - y).max() <= limit * x.max(), (name, np.abs(x - y).max() / x.max())
dv = boost["Velocities"][:] - rest["Velocities"][:] - (1000, 0, 0)
assert np.abs(dv).max() < 2e-3, np.abs(dv).max()
P
fi
$python "$TEPHRA_SOURCE/tests/scenes/validate.py" --gates --out runs; status=$?
[ $status -eq 77 ] && [ $failures -eq 0 ] && exit 77
[ $status -eq 0 ] || fail "a problem is beyond its gate"
finish
