#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts the error of SPH against its cost, one knob at a time, on problems with exact solutions.

    sweep.py [--problem sod --n 20000] [--out DIR]

Writes sweep_PROBLEM.csv and sweep_PROBLEM.png. Every run differs from the default in one setting alone.
"""
import argparse
import sys
from pathlib import Path

import validate
from validate import plt

KNOBS = {
    "number of rows": ("start.n", None),
    "neighbours": ("sph.neighbours", (32, 40, 50, 64, 80)),
    "Courant factor": ("sph.courant", (0.1, 0.2, 0.3, 0.4, 0.6)),
    "viscosity alpha (beta = 2 alpha)": ("sph.alpha", (0.25, 0.5, 1, 2)),
    "steps": ("time.steps", ("individual", "common")),
    "Balsara's switch": ("sph.balsara", ("on", "off")),
}


def settings(key, value):
    return [f"{key}={value}"] + ([f"sph.beta={2 * value}"] if key == "sph.alpha" else [])


def sweep(name, n, options):
    rows = []
    for knob, (key, values) in KNOBS.items():
        for value in values or (n // 8, n // 2, n, 2 * n):
            options.label = f"{key.split('.')[1]}_{value}"
            options.set = [] if values is None else settings(key, value)
            row = validate.measure(name, value if values is None else n, options)
            rows.append({"knob": knob, "value": value, **row})
    return rows


def draw(rows, title, path):
    figure, axis = plt.subplots(figsize=(7, 5))
    for knob in KNOBS:
        line = [row for row in rows if row["knob"] == knob]
        cost, error = [row["CPU s"] for row in line], [row["L1 density"] for row in line]
        axis.plot(cost, error, "o-", ms=4, lw=1, label=knob)
        for row in line:
            axis.annotate(f" {row['value']}", (row["CPU s"], row["L1 density"]), fontsize=7)
    axis.set(xscale="log", yscale="log", xlabel="CPU s", ylabel="L1 error of the density", title=title)
    axis.grid(alpha=0.25, which="both")
    axis.legend(fontsize=8, frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problem", default="sod", choices=validate.PROBLEMS)
    parser.add_argument("--n", type=int, default=20000)
    parser.add_argument("--out", type=Path, default=Path("run-problems"))
    parser.add_argument("--tephra", type=Path, default=validate.BUILD / "tephra")
    parser.add_argument("--keep", action="store_true", help="use runs that are there")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = sweep(options.problem, options.n, options)
    validate.save(rows, options.out / f"sweep_{options.problem}.csv")
    draw(rows, f"{options.problem}, N = {options.n} unless varied", options.out / f"sweep_{options.problem}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
