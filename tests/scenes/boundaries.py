#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks settings of SPH across the boundaries at which it fails (doc/manual/sph.md).

    boundaries.py [SWEEP ...] [--out DIR]

Writes boundaries.csv and boundaries.png: for each sweep what it does to a problem, and where `tephra check` warns.
"""
import argparse
import csv
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import validate
from validate import np, plt

NO_LIMIT = 1 << 20


@dataclass
class Sweep:
    title: str
    problem: str
    n: int
    figures: tuple          # what is drawn
    lines: dict             # label: settings, {} being the value
    values: tuple
    log: bool = True        # the value's axis


SWEEPS = {
    "pairing": Sweep("pairs: rows closer than half a spacing, in parts", "pairing", 1728, ("paired",),
                     {"cubic": ("sph.neighbours={}",), "Wendland C2": ("sph.neighbours={}", "sph.kernel=wendland_c2")},
                     (40, 50, 55, 64, 80, 128, 200)),
    "step_ratio": Sweep("steps of neighbours: energy error, explosion from one row", "sedov_contrast", 4096, ("energy error",),
                        {"conduction 0.1": ("sph.step_ratio={}",), "none": ("sph.step_ratio={}", "sph.conduction=0")},
                        (1, 2, 4, 8, 16, 64, NO_LIMIT)),
    "alpha": Sweep("viscosity alpha (beta = 2 alpha): L1 velocity", "sod", 2500, ("L1 velocity",),
                   {"classic": ("sph.alpha={}", "sph.beta={2}"),
                    "modern": ("sph.alpha={}", "sph.beta={2}", "sph.preset=modern")}, (0, 0.1, 0.25, 0.5, 1, 2), False),
    "conduction": Sweep("conduction: shock over exact, explosion from one row", "sedov_contrast", 4096,
                        ("shock/exact", "energy error"), {"own steps": ("sph.conduction={}",)}, (0, 0.03, 0.1, 0.3, 1, 3), False),
    "disc": Sweep("a disc: angular momentum that its inner part loses in an orbit", "disc", 4000, ("L lost an orbit", "of c h/10"),
                  {"Balsara off": ("sph.alpha={}", "sph.beta={2}", "sph.balsara=off"), "classic": ("sph.alpha={}", "sph.beta={2}"),
                   "modern": ("sph.alpha={}", "sph.beta={2}", "sph.preset=modern")}, (0.25, 1), False),
    "boost": Sweep("a tube that moves, in speeds of sound: updates a row", "sod", 2500, ("updates a row",),
                   {"signal": ("start.velocity_left={}", "start.velocity_right={}", "time.end=0.02"),
                    "classic": ("start.velocity_left={}", "start.velocity_right={}", "time.end=0.02", "time.criterion=classic")},
                   (0, 1, 10, 100), False),
    "h_min": Sweep("least h, in spacings: microseconds an update", "pairing", 1728, ("us/update", "paired"), {"h_min": ("sph.h_min={h}",)},
                   (0.25, 0.5, 0.6, 0.75, 1, 1.5), False),
    "courant": Sweep("Courant factor: energy error of Sedov's explosion", "sedov", 4096, ("energy error",),
                     {"own steps": ("sph.courant={}",), "common": ("sph.courant={}", "time.steps=common")},
                     (0.1, 0.3, 0.5, 1, 2)),
}


def settings(sweep, texts, value):
    words = ["output.energy_limit=1e300"] + [t.replace("{}", f"{value:g}" if value != NO_LIMIT else str(value)).replace("{2}", f"{2 * value:g}")
             .replace("{h}", f"{value * sweep.n**(-1 / 3):g}") for t in texts]
    return words


def warned(sweep, words, options):
    """Whether `tephra check` warns of these settings."""
    problem = validate.PROBLEMS[sweep.problem]
    scene = validate.SOURCE / "ics" / f"{problem.scene or sweep.problem}.yml"
    command = [options.tephra, "check", scene, "--set", f"start.n={sweep.n}"]
    if problem.make:
        command = [options.tephra, "check", problem.make(options.out, sweep.n)]
    for word in problem.settings + tuple(words):
        command += ["--set", word]
    return "warning: " in subprocess.run(command, capture_output=True, text=True).stderr


def measure(name, options):
    sweep, rows = SWEEPS[name], []
    for label, texts in sweep.lines.items():
        for value in sweep.values:
            options.label = f"{name}_{label}_{value:g}".replace(" ", "_")
            options.set = settings(sweep, texts, value)
            row = validate.measure(sweep.problem, sweep.n, options)
            log = (options.out / f"{sweep.problem}_{sweep.n}_{options.label}" / "log.txt").read_text()
            updates = float(log.split(" updates, ")[0].split()[-1])
            figures = {"updates a row": updates / sweep.n, **row}
            rows += [{"sweep": name, "line": label, "value": value, "warned": warned(sweep, options.set, options),
                      **{f"figure {k + 1}": f"{figure} = {figures[figure]:.4g}" for k, figure in enumerate(sweep.figures)},
                      "y": figures[sweep.figures[0]]}]
    return rows


def draw(rows, path):
    names = list(dict.fromkeys(row["sweep"] for row in rows))
    columns = min(4, len(names))
    figure, axes = plt.subplots(-(-len(names) // columns), columns, figsize=(4.4 * columns, 3.4 * -(-len(names) // columns)),
                                squeeze=False)
    for axis, name in zip(axes.flat, names):
        sweep = SWEEPS[name]
        for label in sweep.lines:
            line = [row for row in rows if row["sweep"] == name and row["line"] == label]
            x = [row["value"] for row in line]
            drawn, = axis.plot(x, [row["y"] for row in line], "-", lw=1, label=label)
            for row in line:
                axis.plot(row["value"], row["y"], "x" if row["warned"] else "o", color=drawn.get_color(), ms=6)
        if sweep.log:
            axis.set_xscale("log")
        elif max(sweep.values) > 100:
            axis.set_xscale("symlog")
        y = np.array([row["y"] for row in rows if row["sweep"] == name])
        if y.min() > 0 and y.max() > 20 * y.min():
            axis.set_yscale("log")
        axis.set_title(sweep.title, fontsize=8)
        axis.grid(alpha=0.25)
        axis.legend(fontsize=7, frameon=False)
    figure.suptitle("o: within the boundary, x: tephra check warns", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sweep", nargs="*", choices=[*SWEEPS, []], help=", ".join(SWEEPS))
    parser.add_argument("--out", type=Path, default=Path("run-boundaries"))
    parser.add_argument("--tephra", type=Path, default=validate.BUILD / "tephra")
    parser.add_argument("--keep", action="store_true", help="runs that are there are not repeated")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = [row for name in options.sweep or SWEEPS for row in measure(name, options)]
    with open(options.out / "boundaries.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, options.out / "boundaries.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
