#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Radial profiles of the gas of a snapshot: density, radial velocity, entropy. At t = 0.8 of the
Evrard collapse they are compared with the converged one-dimensional solution.

    python3 doc/plots/profile.py RUN_DIR [--time 0.8]
    python3 doc/plots/profile.py SNAPSHOT.hdf5

Writes a picture beside the snapshot. The numbers printed are rms differences over those of 30
logarithmic bins of 0.01 < r < 1 that the reference covers: of log10 density, of v_r, and of the
entropy P / rho^(5/3) relative to the reference.
"""
import argparse
from pathlib import Path

import h5py
import numpy as np

import runs
from runs import plt

GAMMA = 5 / 3
BINS = np.geomspace(0.01, 1, 31)
NAMES = ("density", "radial velocity", "entropy")


def read_gas(path):
    """r, (density, radial velocity, entropy) and mass of the rows, and the time."""
    try:
        with h5py.File(path, "r") as file:
            gas = file["PartType0"]
            pos, vel, mass = (gas[name][:] for name in ("Coordinates", "Velocities", "Masses"))
            density, u = gas["Density"][:].astype(float), gas["InternalEnergy"][:].astype(float)
            time = float(file["Header"].attrs["Time"])
    except OSError:
        runs.stop(f"{path} is not an HDF5 file, or not a whole one")
    except KeyError as missing:
        runs.stop(f"{path} has no gas with all that a profile needs: {missing.args[0]}")
    mass = mass.astype(float)
    centre = np.average(pos, axis=0, weights=mass)
    drift = np.average(vel, axis=0, weights=mass)
    radius = np.linalg.norm(pos - centre, axis=1)
    radial = np.sum((pos - centre) * (vel - drift), axis=1) / np.maximum(radius, 1e-300)
    return radius, (density, radial, (GAMMA - 1) * u / density ** (GAMMA - 1)), mass, time


def bin_means(radius, value, mass):
    """Mass-weighted means in the bins; not a number where a bin is empty."""
    total = np.histogram(radius, BINS, weights=mass)[0]
    with np.errstate(invalid="ignore"):
        return np.histogram(radius, BINS, weights=mass * value)[0] / total


def converged():
    """r and the three profiles of the one-dimensional solution."""
    data = runs.reference("evrard_profile_0.8.csv")
    return data["r"], (data["density"], data["radial_velocity"], data["pressure"] / data["density"] ** GAMMA)


def deviations(radius, values, mass):
    """Rms over the bins that the reference covers; the reference is taken at each row's radius and
    averaged like the rows, so that the shock falls into its bin as the rows do."""
    r, profiles = converged()
    seen = (radius > r[0]) & (radius < r[-1])
    result = []
    for name, value, profile in zip(NAMES, values, profiles):
        exact = np.interp(np.log(radius[seen]), np.log(r), profile)
        mine, theirs = (bin_means(radius[seen], x, mass[seen]) for x in (value[seen], exact))
        if name == "density":
            mine, theirs = np.log10(mine), np.log10(theirs)
        elif name == "entropy":
            mine, theirs = mine / theirs, 1
        result.append(np.sqrt(np.nanmean((mine - theirs) ** 2)))
    return result


def draw(path, radius, values, mass, compare):
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.6), layout="constrained")
    middle = np.sqrt(BINS[1:] * BINS[:-1])
    some = np.random.default_rng(1).permutation(len(radius))[:20000]
    for axis, name, value in zip(axes, NAMES, values):
        axis.plot(radius[some], value[some], ",", color="#0072b2", alpha=0.5, rasterized=True)
        axis.plot(middle, bin_means(radius, value, mass), "o", color="#0072b2", markersize=4, label="mean of the rows")
        axis.set(xscale="log", xlabel="r", title=name, xlim=(max(BINS[0], radius.min()), min(radius.max(), 2)))
        if name != "radial velocity":
            axis.set_yscale("log")
    if compare:
        r, profiles = converged()
        for axis, profile in zip(axes, profiles):
            axis.plot(r, profile, color="#d55e00", label="converged, 1-D")
    axes[0].legend()
    runs.save(figure, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("path", metavar="RUN_DIR or SNAPSHOT.hdf5")
    parser.add_argument("--time", type=float, default=0.8, help="the snapshot nearest to it is taken (0.8)")
    parser.add_argument("--out", help="picture to write (default: profile_NNN.png beside the snapshot)")
    options = parser.parse_args()
    path = Path(options.path)
    if path.is_dir():
        path = min(runs.snapshots(path), key=lambda found: abs(found[0] - options.time))[1]
    radius, values, mass, time = read_gas(path)
    compare = runs.is_evrard(path.parent) and abs(time - 0.8) < 5e-3
    print(f"{path}: t = {time:g}, {len(radius)} rows")
    if compare:
        for name, value, unit in zip(NAMES, deviations(radius, values, mass), ("dex", "", "(relative)")):
            print(f"{name:16s} rms difference {value:.4f} {unit}".rstrip())
    draw(options.out or path.with_name(path.stem.replace("snapshot", "profile") + ".png"), radius, values, mass, compare)


if __name__ == "__main__":
    main()
