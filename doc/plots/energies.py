#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Energies of a run against time, with the error of their sum; for the Evrard collapse beside the
converged one-dimensional solution.

    python3 doc/plots/energies.py RUN_DIR [--out FILE.png]

Writes RUN_DIR/energies.png and prints the extrema.
"""
import argparse

import numpy as np

import runs
from runs import plt


def print_extrema(energy, reference):
    """Largest kinetic and thermal, smallest potential energy: value, time, and against the reference."""
    for name, pick in (("kinetic", np.argmax), ("thermal", np.argmax), ("potential", np.argmin)):
        i = pick(energy[name])
        text = f"{name:10s} {energy[name][i]:12.5g} at t = {energy['t'][i]:.4g}"
        if reference:
            converged = {"kinetic": 0.452, "thermal": 1.763, "potential": -2.550}[name]
            text += f"   converged {converged:.5g}, {100 * (energy[name][i] / converged - 1):+.1f} %"
        print(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", metavar="RUN_DIR")
    parser.add_argument("--out", help="picture to write (default: RUN_DIR/energies.png)")
    options = parser.parse_args()
    run = runs.folder(options.run)
    energy = runs.table(run / "energy.csv")
    reference = runs.reference("evrard_reference.csv") if runs.is_evrard(run) else None

    figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 7), sharex=True, height_ratios=[3, 1],
                                         layout="constrained")
    for name, colour in runs.COLOURS.items():
        top.plot(energy["t"], energy[name], color=colour, label=name)
        if reference and name in reference:
            top.plot(reference["t"], reference[name], "o", color=colour, markersize=4, alpha=0.8,
                     label="converged, 1-D" if name == "kinetic" else None)
    top.set(title=runs.title(run), ylabel="energy")
    top.legend(ncols=3)
    bottom.semilogy(energy["t"], np.maximum(abs(energy["error"]), 1e-17), color="#555555")
    bottom.set(xlabel="t", ylabel="|error of the total|")

    print_extrema(energy, reference)
    print(f"largest relative error of the total: {abs(energy['error']).max():.3g}")
    runs.save(figure, options.out or run / "energies.png")


if __name__ == "__main__":
    main()
