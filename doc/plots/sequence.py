#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A contact sheet of the pictures of a run.

    python3 doc/plots/sequence.py RUN_DIR [--number 9] [--columns 3] [--out FILE.png]

Takes pictures at equal distances, the first and the last among them, and writes RUN_DIR/sequence.png.
"""
import argparse

import numpy as np

import runs
from runs import plt


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", metavar="RUN_DIR")
    parser.add_argument("--number", type=int, default=9, help="how many pictures (9)")
    parser.add_argument("--columns", type=int, default=3, help="how many beside each other (3)")
    parser.add_argument("--out", help="picture to write (default: RUN_DIR/sequence.png)")
    options = parser.parse_args()
    run = runs.folder(options.run)
    pictures = sorted(run.glob("picture_*.png"))
    if not pictures:
        runs.stop(f"{run} has no pictures: set output.picture_every")
    if options.number < 1 or options.columns < 1:
        runs.stop("--number and --columns must be at least 1")
    chosen = np.unique(np.linspace(0, len(pictures) - 1, options.number).round().astype(int))
    columns = min(options.columns, len(chosen))
    rows = -(-len(chosen) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(5.4 * columns, 3.04 * rows), squeeze=False,
                                facecolor="black", gridspec_kw={"wspace": 0, "hspace": 0})
    figure.subplots_adjust(0, 0, 1, 1)
    for axis in axes.flat:
        axis.axis("off")
    for axis, i in zip(axes.flat, chosen):
        axis.imshow(plt.imread(pictures[i]), interpolation="antialiased")
    figure.savefig(options.out or run / "sequence.png", dpi=150, facecolor="black")
    print(options.out or run / "sequence.png")


if __name__ == "__main__":
    main()
