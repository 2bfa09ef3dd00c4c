#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost and clumps of the cloud collision along a ladder of particle numbers, beside the TREE-GRAPE runs of 2008.

    for n in 2048 4096 8192 32768; do tephra run ics/cloud_collision.yml --threads 1 --set start.n=$n --out ladder$n; done
    python3 doc/plots/ladder.py ladder2048 ladder4096 ladder8192 ladder32768 [--csv FILE.csv] [--out FILE.png]
    python3 doc/plots/ladder.py --from FILE.csv --out FILE.png

Reads profile.csv, energy.csv and the last clumps_NNN.csv of each run directory. Runs that have not come to the end of the
longest are told apart, and left out of the fit CPU s = a N^b that is drawn to 2 x 512k.
"""
import argparse
import csv
from pathlib import Path

import numpy as np

import runs
from runs import plt

# Minutes for N a cloud, isothermal gas down to 1e-4 pc, on four nodes: the table shown in 2008.
GRAPE = {4: 52, 8: 104.4, 16: 210, 32: 414, 64: 840, 128: 1680, 256: 3300, 512: 6660}
COLUMNS = ("rows", "t_end", "cpu_s", "clumps", "clumped_part", "largest_msun", "resolved")


def measure(run):
    run = runs.folder(run)
    with open(run / "profile.csv", newline="") as file:
        cpu = sum(float(row["cpu [s]"]) for row in csv.DictReader(file))
    energy = runs.table(run / "energy.csv")
    mass = energy["mass_gas"][-1]
    rows = energy["active"][0]
    lists = sorted(run.glob("clumps_*.csv"))
    lines = [line for line in lists[-1].read_text().splitlines()[1:]] if lists else []
    masses = np.array([float(line.split(",")[2]) for line in lines])
    resolved = "NOT resolved" not in (run / "log.txt").read_text()
    return dict(zip(COLUMNS, (int(rows), energy["t"][-1], cpu, len(masses), masses.sum() / mass if len(masses) else 0,
                              1e10 * masses.max() if len(masses) else 0, int(resolved))))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", nargs="*", metavar="RUN_DIR")
    parser.add_argument("--from", dest="table", help="a CSV that --csv has written, instead of runs")
    parser.add_argument("--csv", help="write what was measured")
    parser.add_argument("--out", default="ladder.png")
    options = parser.parse_args()
    if bool(options.run) == bool(options.table):
        runs.stop("give run directories, or --from FILE.csv")
    if options.table:
        read = runs.table(options.table)
        steps = [dict(zip(COLUMNS, values)) for values in zip(*(read[c] for c in COLUMNS))]
    else:
        steps = sorted((measure(run) for run in options.run), key=lambda step: step["rows"])
    lines = [",".join(COLUMNS)] + [",".join(f"{step[c]:.6g}" for c in COLUMNS) for step in steps]
    print("\n".join(lines))
    if options.csv:
        Path(options.csv).write_text("\n".join(lines) + "\n")
    end = max(step["t_end"] for step in steps)
    whole = [step for step in steps if step["t_end"] > 0.999 * end]
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.6), layout="constrained")
    left.loglog([2e3 * 1.024 * n for n in GRAPE], [60 * m for m in GRAPE.values()], "s--", color="#999999",
                label="TREE-GRAPE on 4 nodes, 2008, by the clock\n(isothermal to 1e-4 pc: another problem)")
    left.loglog([s["rows"] for s in whole], [s["cpu_s"] for s in whole], "o", color="#0072b2", label="tephra, CPU s, barotropic")
    if len(whole) > 1:
        power, lift = np.polyfit(np.log([s["rows"] for s in whole]), np.log([s["cpu_s"] for s in whole]), 1)
        reach = np.array([whole[0]["rows"], 2 * 512 * 1024])
        left.loglog(reach, np.exp(lift) * reach ** power, ":", color="#0072b2", label=f"fit ~ N^{power:.2f}, drawn on")
        for n in (4, 16, 64, 512):
            print(f"2 x {n}k: {np.exp(lift) * (2048 * n) ** power:.3g} CPU s by the fit")
    left.set(xlabel="rows of both clouds", ylabel="seconds")
    left.legend(fontsize=8)
    right.semilogx([s["rows"] for s in whole], [s["largest_msun"] for s in whole], "o-", color="#d55e00",
                   label="largest clump at the end [Msun]")
    right.semilogx([s["rows"] for s in whole], [1000 * s["clumps"] for s in whole], "^-", color="#009e73",
                   label="clumps, times 1000")
    right.set(xlabel="rows of both clouds", ylim=(0, None))
    right.legend(fontsize=8)
    runs.save(figure, options.out)


if __name__ == "__main__":
    main()
