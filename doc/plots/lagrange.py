#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lagrangian radii of each species against time: what an equilibrium should keep.

    python3 doc/plots/lagrange.py RUN_DIR [--parts 10,30,50,70,90] [--out FILE.png]

Prints each radius, its change at the end and its largest change, and the virial ratio; writes RUN_DIR/lagrange.png. The
centre is where the density is largest: the mean of the rows shrunk to those near it (Power et al. 2003).
"""
import argparse

import h5py
import numpy as np

import runs
from runs import plt

NAMES = {0: "gas", 1: "dark", 3: "cloud", 4: "star"}
SHRINK, FEWEST = 0.9, 200       # the sphere about the centre, a round; rows it must hold


def centre(pos):
    middle = np.median(pos, axis=0)
    r = np.linalg.norm(pos - middle, axis=1)
    reach = np.quantile(r, 0.9)
    while np.count_nonzero(r < reach) > FEWEST:
        middle = pos[r < reach].mean(axis=0)
        r = np.linalg.norm(pos - middle, axis=1)
        reach *= SHRINK
    return middle


def radii(path, parts):
    """Radii by species, and 2K + 3 (gamma - 1) U over -W (gamma 5/3), from one snapshot."""
    found, twice, potential = {}, 0.0, 0.0
    with h5py.File(path, "r") as file:
        groups = {k: file[f"PartType{k}"] for k in NAMES if f"PartType{k}" in file}
        middle = centre(np.concatenate([g["Coordinates"][:] for g in groups.values()]))
        for k, group in groups.items():
            mass = group["Masses"][:]
            r = np.linalg.norm(group["Coordinates"][:] - middle, axis=1)
            order = np.argsort(r)
            within = np.cumsum(mass[order])
            found[NAMES[k]] = np.interp(np.array(parts) / 100 * within[-1], within, r[order])
            twice += np.sum(mass * np.sum(group["Velocities"][:]**2, axis=1))
            if "InternalEnergy" in group:
                twice += 2 * np.sum(mass * group["InternalEnergy"][:])
            if "Potential" in group:
                potential += 0.5 * np.sum(mass * group["Potential"][:])
    return found, twice / -potential if potential else np.nan


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", metavar="RUN_DIR")
    parser.add_argument("--parts", default="10,30,50,70,90", help="percentages of the mass (10,30,50,70,90)")
    parser.add_argument("--out", help="picture to write (default: RUN_DIR/lagrange.png)")
    options = parser.parse_args()
    parts = [float(part) for part in options.parts.split(",")]
    snapshots = runs.snapshots(options.run)
    times = np.array([time for time, _ in snapshots])
    all_radii, virial = zip(*(radii(path, parts) for _, path in snapshots))
    names = list(all_radii[0])
    figure, axes = plt.subplots(1, len(names), figsize=(4.2 * len(names), 4), squeeze=False)
    print("species,part,radius,change at the end,largest change")
    for axis, name in zip(axes[0], names):
        table = np.array([found[name] for found in all_radii])
        for part, r in zip(parts, table.T):
            change = r / r[0] - 1
            print(f"{name},{part:g} %,{r[0]:.4g},{change[-1]:+.2%},{change[np.abs(change).argmax()]:+.2%}")
            axis.plot(times, r, label=f"{part:g} %")
        axis.set(title=name, xlabel="t", yscale="log", ylabel="radius")
    axes[0][0].legend(fontsize=8)
    print(f"virial ratio {np.nanmin(virial):.4f} to {np.nanmax(virial):.4f}")
    figure.suptitle(runs.title(options.run))
    figure.tight_layout()
    runs.save(figure, options.out or f"{options.run}/lagrange.png")


if __name__ == "__main__":
    main()
