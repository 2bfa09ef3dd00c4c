#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Snapshots are what yt, pynbody and scripts with h5py take them for: kpc, 1e10 Msun, km/s, Gyr. The
# readers that are installed are asked; without h5py the test is left out.
. "$TEPHRA_SOURCE/tests/lib.sh"

for python in "${PYTHON:-/usr/bin/python3}" python3; do "$python" -c 'import h5py' 2>/dev/null && break; python=; done
[ "$python" ] || { echo "h5py is not installed"; exit 77; }

cat >scene.yml <<'Y'
title: cloud of three parsec
units: {length: pc, mass: Msun, velocity: km/s}
start: {generator: evrard, n: 1000, mass: 2000 Msun, radius: 3 pc}
time:  {end: 0.01 Myr}
output: {snapshot_every: 0.01 Myr}
gravity: {softening: 0.02 pc}
sph: {}
profiles: {outer: 3}
Y
expect_status 0 tephra run scene.yml --out run

cat >readers.py <<'P'
import importlib.util, sys
import h5py
import numpy as np

FILE, MSUN, KPC, GYR = "run/snapshot_001.hdf5", 1.98841e33, 3.0856776e21, 3.15576e16
wrong = 0


def near(name, value, expected, tolerance=1e-4):
    global wrong
    if not abs(value - expected) <= tolerance * abs(expected):
        print(f"FAIL: {name} is {value}, not {expected}")
        wrong += 1


with h5py.File(FILE) as f:
    header, gas = f["Header"].attrs, f["PartType0"]
    near("rows", header["NumPart_ThisFile"][0], 1000)
    near("mass", gas["Masses"][:].sum() * gas["Masses"].attrs["to_cgs"], 2000 * MSUN)
    near("Time_GYR", f["Parameters"].attrs["Time_GYR"], 1e-5)
    near("Time", header["Time"] * f["Units"].attrs["UnitTime_in_s"], 1e-5 * GYR)
    near("radius", np.linalg.norm(gas["Coordinates"][:], axis=1).max(), 0.003, 0.1)
    near("order by id", float(np.diff(gas["ParticleIDs"][:].astype(float)).min() > 0), 1)
    # 50 neighbours within the length given: (4 pi / 3) rho H^3 = 50 m
    number = 4 * np.pi / 3 * gas["Density"][:] * gas["SmoothingLength"][:].astype(float) ** 3 / gas["Masses"][:]
    near("neighbours within SmoothingLength", np.median(number), 50, 0.2)
    near("temperature", np.median(gas["Temperature"][:] / gas["InternalEnergy"][:]), 48.459, 1e-3)
    if "OmegaLambda" in header or "HubbleParam" in header:
        print("FAIL: the file looks cosmological")
        wrong += 1
    speed, reach = np.linalg.norm(gas["Velocities"][:], axis=1).max(), abs(gas["Coordinates"][:]).max()
    density, gas_temperature = gas["Density"][:].max(), gas["Temperature"][:].max()

if importlib.util.find_spec("yt"):
    import yt
    yt.set_log_level(50)
    ds = yt.load(FILE)
    all_data = ds.all_data()
    near("yt: mass", float(all_data["PartType0", "Masses"].sum().to("g")), 2000 * MSUN)
    near("yt: time", float(ds.current_time.to("s")), 1e-5 * GYR)
    near("yt: length", float(ds.length_unit.to("cm")), KPC)
    near("yt: density", float(all_data["gas", "density"].max().to("g/cm**3")), density * 1e10 * MSUN / KPC ** 3)
    near("yt: velocity", float(all_data["PartType0", "particle_velocity_magnitude"].max().to("cm/s")), speed * 1e5)
    near("yt: temperature", float(all_data["gas", "temperature"].max().to("K")), gas_temperature)
    near("yt: radius", float(abs(all_data["PartType0", "Coordinates"]).max().to("cm")), reach * KPC)
    print("yt", yt.__version__)
else:
    print("yt is not installed (python3-yt): it was not asked")
if importlib.util.find_spec("pynbody"):
    import pynbody
    s = pynbody.load(FILE)
    s.physical_units()
    near("pynbody: mass", float(s.g["mass"].in_units("Msol").sum()), 2000)
    near("pynbody: time", float(s.properties["time"].in_units("Gyr")), 1e-5)
    near("pynbody: density", float(s.g["rho"].in_units("Msol kpc**-3").max()), density * 1e10)
    near("pynbody: temperature", float(s.g["temp"].max()), gas_temperature)
    print("pynbody", pynbody.__version__)
sys.exit(wrong > 0)
P
"$python" -W ignore readers.py >out_text 2>err || { fail "a reader is misled"; cat out_text; tail -n 5 err; }
cat out_text

# The plots run, and say what is wrong in one line.
export MPLCONFIGDIR="$scratch"
if "$python" -c 'import matplotlib' 2>/dev/null; then
    for plot in analysis energies profile sequence; do
        expect_status 0 "$python" -W ignore "$TEPHRA_SOURCE/doc/plots/$plot.py" run
        expect_status 1 "$python" -W ignore "$TEPHRA_SOURCE/doc/plots/$plot.py" nowhere
        [ "$(wc -l <err)" -eq 1 ] || fail "$plot.py: more than one line: $(head -n 3 err)"
    done
fi

# More rows than the program counts: refused before they are read (the file holds none of them).
"$python" - <<'P' || fail "no file of 3e9 rows"
import h5py
with h5py.File("many.hdf5", "w") as f:
    f.create_group("Header").attrs["MassTable"] = [0., 1., 0., 0., 0., 0.]
    for name, shape, kind in ("Coordinates", (3000000000, 3), "f8"), ("ParticleIDs", (3000000000,), "u8"):
        f.create_dataset("PartType1/" + name, shape, kind, chunks=(65536,) + shape[1:])
P
expect_status 2 tephra compare many.hdf5 many.hdf5
expect_text 'PartType1 has 3000000000 rows: at most 2147483647 can be compared' err
cat >many.yml <<'Y'
units: {G: 1}
start: {file: many.hdf5}
time: {end: 1}
output: {snapshot_every: 1}
gravity: {softening: 1}
Y
expect_status 2 tephra check many.yml
expect_text 'many.hdf5 holds more than the 2147483647 rows that a rank can have' err
finish
