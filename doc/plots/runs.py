# SPDX-License-Identifier: GPL-3.0-or-later
"""What the plots share: reading runs, references, looks, and errors in one sentence."""
import csv
import re
import sys
from pathlib import Path

try:
    import h5py
    import matplotlib
    import numpy as np
except ImportError as missing:
    sys.exit(f"error: {missing.name} is missing: apt-get install python3-{missing.name.lower()}")
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of the backend)

DATA = Path(__file__).resolve().parents[2] / "tests" / "data"
COLOURS = {"kinetic": "#0072b2", "thermal": "#d55e00", "potential": "#009e73", "total": "#000000"}

plt.rcParams.update({
    "figure.dpi": 110, "savefig.dpi": 200, "font.size": 11, "axes.grid": True, "grid.alpha": 0.25,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "lines.linewidth": 1.8,
})


def stop(text):
    sys.exit(f"error: {text}")


def folder(path):
    """A run directory."""
    path = Path(path)
    if not path.is_dir():
        stop(f"{path} is not a run directory")
    return path


def table(path):
    """Columns of a CSV file by name; lines that begin with # are left out, units [..] of names too."""
    try:
        lines = [line for line in Path(path).read_text().splitlines() if line and line[0] != "#"]
    except OSError as problem:
        stop(f"{path}: {problem.strerror}")
    rows = list(csv.reader(lines))
    if len(rows) < 2:
        stop(f"{path} has no rows yet")
    names = [name.split(" [")[0] for name in rows[0]]
    try:
        return dict(zip(names, np.array(rows[1:], float).T))
    except ValueError:
        stop(f"{path}: the rows are not all numbers or differ in length")


def reference(name):
    return table(DATA / name)


def is_evrard(run):
    """Whether a run directory holds the collapse that the references describe."""
    used = Path(run) / "used.yml"
    return used.is_file() and re.search(r"^ *generator: *[\"']?evrard\b", used.read_text(), re.M) is not None


def title(run):
    used = Path(run) / "used.yml"
    lines = used.read_text().splitlines() if used.is_file() else []
    found = [line[len("title:"):].strip(" \"'") for line in lines if line.startswith("title:")]
    return found[0] if found else Path(run).resolve().name


def snapshots(run):
    """Snapshots of a run directory in the order of their times: (time, path)."""
    found = []
    for path in sorted(Path(run).glob("snapshot_*.hdf5")):
        try:
            with h5py.File(path, "r") as file:
                found.append((float(file["Header"].attrs["Time"]), path))
        except (OSError, KeyError):
            print(f"warning: {path} is not a whole snapshot", file=sys.stderr)
    if not found:
        stop(f"{run} has no snapshots")
    return sorted(found)


def save(figure, path):
    figure.savefig(path, bbox_inches="tight")
    print(path)
