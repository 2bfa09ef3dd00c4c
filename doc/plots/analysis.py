#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the block `profiles` and the modules of stars have written of a run: Lagrangian radii, surface density, rotation and
height of discs at the start and at the end, distance of two objects, star formation history.

    python3 doc/plots/analysis.py RUN_DIR [--from R --to R] [--out FILE.png]

Writes RUN_DIR/analysis.png and prints changes: radii, and of each species the scale length of an exponential disc fitted to the
rings between two radii, its height and its rotation there.
"""
import argparse

import numpy as np

import runs
from runs import plt

SPECIES = ("gas", "cloud", "star", "dark")
FEWEST = 20                     # rows of a ring that counts


def draw_radii(axis, table):
    for name, colour in zip(SPECIES, ("#0072b2", "#009e73", "#d55e00", "#555555")):
        for column in (c for c in table if c.startswith(name + "_")):
            r = table[column]
            if np.isfinite(r).sum() < 2:
                continue
            axis.semilogy(table["t"], r, color=colour, linewidth=1, label=name if column.endswith("_50") else None)
            first = r[np.isfinite(r)][0]       # stars may come later
            change = r / first - 1
            print(f"{name} {column.split('_')[1]} %: {first:.4g}, at the end {change[-1]:+.1%}, "
                  f"at most {change[np.nanargmax(abs(change))]:+.1%}")
    axis.set(xlabel="t", ylabel="radii that hold parts of the mass")
    axis.legend(fontsize=8)


def fit(table, at, name, low, high):
    """Scale length, and means weighted by rows of height, rotation and circular speed, of the rings at one time."""
    rows, sigma = table[name + "_rows"][at], table[name + "_surface_density"][at]
    middle = 0.5 * (table["from"][at] + table["to"][at])
    good = (rows >= FEWEST) & (middle > low) & (middle < high)
    if good.sum() < 3:
        return None
    slope = np.polyfit(middle[good], np.log(sigma[good]), 1, w=np.sqrt(rows[good]))[0]
    return [-1 / slope] + [np.average(table[f"{name}_{c}"][at][good], weights=rows[good])
                           for c in ("height", "rotation", "circular")]


def draw_rings(axes, table, low, high):
    times = np.unique(table["t"])
    for name in (s for s in SPECIES if s + "_rows" in table):
        fits = [fit(table, table["t"] == t, name, low, high) for t in times]
        if all(fits) and name != "dark":
            for k, what in enumerate(("scale length", "height", "rotation", "circular speed")):
                values = np.array([f[k] for f in fits])
                change = values / values[0] - 1
                print(f"{name} {what} of {low:g} < R < {high:g}: {values[0]:.4g}, at the end {change[-1]:+.1%}, "
                      f"at most {change[abs(change).argmax()]:+.1%}")
        for t, style in ((times[0], ":"), (times[-1], "-")):
            at = (table["t"] == t) & (table[name + "_rows"] >= FEWEST)
            middle = 0.5 * (table["from"][at] + table["to"][at])
            for axis, column in zip(axes, ("surface_density", "rotation", "circular")):
                axis.plot(middle, table[f"{name}_{column}"][at], style, label=f"{name}, t = {t:.3g}")
    for axis, label in zip(axes, ("surface density", "mean speed of rotation", "speed on a circle, from forces")):
        axis.set(xlabel="R", ylabel=label)
    axes[0].set_yscale("log")
    axes[0].legend(fontsize=8)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", metavar="RUN_DIR")
    parser.add_argument("--from", dest="low", type=float, default=0.0, help="rings that are fitted (all)")
    parser.add_argument("--to", dest="high", type=float, default=np.inf)
    parser.add_argument("--out", help="picture to write (default: RUN_DIR/analysis.png)")
    options = parser.parse_args()
    run = runs.folder(options.run)
    there = [n for n in ("lagrange", "rings", "separation", "budget") if (run / f"{n}.csv").is_file()]
    tables = {n: runs.table(run / f"{n}.csv") for n in there}
    if "budget" in tables and "sfr" not in tables["budget"]:
        del tables["budget"]
    if not tables:
        runs.stop(f"{run} has no lagrange.csv: the scene needs a block profiles")
    panels = len(tables) + 2 * ("rings" in tables)
    figure, axes = plt.subplots(-(-panels // 3), min(3, panels), figsize=(5.2 * min(3, panels), 4.2 * -(-panels // 3)),
                                squeeze=False, layout="constrained")
    free = list(axes.flat)
    for axis in free[panels:]:
        axis.axis("off")
    if "lagrange" in tables:
        draw_radii(free.pop(0), tables["lagrange"])
    if "rings" in tables:
        draw_rings([free.pop(0) for _ in range(3)], tables["rings"], options.low, options.high)
    if "separation" in tables:
        axis, apart = free.pop(0), tables["separation"]
        least = apart["separation"].argmin()
        axis.plot(apart["t"], apart["separation"])
        axis.set(xlabel="t", ylabel="distance of the two objects")
        turn = np.flatnonzero((np.diff(apart["separation"])[:-1] < 0) & (np.diff(apart["separation"])[1:] >= 0))
        first = turn[0] + 1 if turn.size else least
        print(f"first passage: distance {apart['separation'][first]:.4g} at t = {apart['t'][first]:.4g}")
    if "budget" in tables:
        axis = free.pop(0)
        axis.plot(tables["budget"]["t"], tables["budget"]["sfr"])
        axis.set(xlabel="t", ylabel="star formation rate")
    figure.suptitle(runs.title(run))
    runs.save(figure, options.out or run / "analysis.png")


if __name__ == "__main__":
    main()
