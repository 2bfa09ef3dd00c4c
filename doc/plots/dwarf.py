#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of ics/dwarf.yml: rates, clouds and hot gas of several beside the literature, the phases of the first in pictures, and its
books from the rows of its snapshots.

    python3 doc/plots/dwarf.py RUN_DIR... [--labels TEXT...] [--out FOLDER]

Writes dwarf.csv and dwarf.png (means of 50 Myr) and dwarf_phases.png into FOLDER (default: the first RUN_DIR) and prints the books:
mass, elements and energy. The energy takes positions, velocities, masses and temperatures from the snapshots and the potential from
direct sums over them; only what has been radiated or injected, which no row tells, is that of energy.csv.
"""
import argparse
from pathlib import Path

import h5py
import numpy as np

import runs
from runs import plt

GYR = 0.9777922216807893        # of kpc/(km/s)
WIDTH = 50                      # Myr
KINDS = {0: "gas", 1: "dark", 3: "cloud", 4: "star"}
LITERATURE = {                  # Liu 2013, Harfst et al. 2006: doc/manual/dwarf.md, section 4
    "rate": ([0, 1000], [1, 0.1], "Liu 2013"),
    "slope": ([0, 1000], [-2, -2], "Harfst et al. 2006"),
    "hot": ([0, 1000], [0.35, 0.35], "Harfst et al. 2006, a large disc"),
}


def series(run):
    """Means of WIDTH Myr."""
    budget = runs.table(run / "budget.csv")
    time = budget["t"] * GYR * 1e3
    ends = np.arange(WIDTH, time[-1] + 1, WIDTH)
    formed = np.interp(np.append(0, ends), time, budget["cloud_stars"])
    inside = [(time > end - WIDTH + 1e-3) & (time < end + 1e-3) for end in ends]
    mean = {name: [budget[column][chosen].mean() for chosen in inside] for name, column in
            (("slope", "cloud_slope"), ("hot", "hot_filling"), ("clouds", "clouds"), ("heaviest", "heaviest_cloud"))}
    return {"t": ends, "rate": np.diff(formed) / WIDTH / 1e6, "stars": formed[1:], **mean}


def chart(all_series, labels, out):
    figure, axes = plt.subplots(3, 1, figsize=(7.5, 9), sharex=True, layout="constrained")
    texts = {"rate": "stars formed [Msun/yr]", "slope": "slope of cloud masses", "hot": "volume of gas that is hot"}
    for axis, (name, text) in zip(axes, texts.items()):
        for one, label in zip(all_series, labels):
            axis.plot(one["t"], one[name], label=label)
        t, y, source = LITERATURE[name]
        axis.plot(t, y, "k--", linewidth=1.2, label=source)
        if name == "slope":
            axis.plot(t, [-2.3, -2.3], "k:", linewidth=1.2, label="Liu 2013")
        axis.set(ylabel=text)
        axis.legend(fontsize=8, ncols=2)
    axes[0].set(yscale="log", ylim=(0.01, 20))
    axes[2].set(xlabel="t [Myr]", ylim=(0, 1))
    runs.save(figure, out / "dwarf.png")
    with open(out / "dwarf.csv", "w") as file:
        file.write("run,t [Myr],rate [Msun yr^-1],stars [Msun],cloud_slope,hot_filling,clouds,heaviest_cloud [Msun]\n")
        for one, label in zip(all_series, labels):
            for row in zip(*(one[name] for name in ("t", "rate", "stars", "slope", "hot", "clouds", "heaviest"))):
                file.write(label + "," + ",".join(f"{value:.5g}" for value in row) + "\n")


def pictures(run, out):
    """Five times in rows; warm gas, hot gas, clouds and stars, seen on edge and from above in turn."""
    found = runs.snapshots(run)
    chosen = [found[i][1] for i in np.linspace(0, len(found) - 1, 6).round().astype(int)[1:]]
    half = 6
    figure, axes = plt.subplots(5, 4, figsize=(11, 13.6), layout="constrained", subplot_kw={"aspect": "equal"})
    for line, path in zip(axes, chosen):
        with h5py.File(path) as file:
            time = float(file["Header"].attrs["Time"]) * GYR * 1e3
            gas = file["PartType0"]
            hot = gas["Temperature"][:] > 1e5
            pos = gas["Coordinates"][:]
            parts = [("gas < 1e5 K", pos[~hot], 20 * gas["SmoothingLength"][:][~hot], "#0072b2", 0.25),
                     ("gas > 1e5 K", pos[hot], 20 * gas["SmoothingLength"][:][hot], "#d55e00", 0.25),
                     ("clouds", file["PartType3/Coordinates"][:], 2 * np.sqrt(file["PartType3/Masses"][:] * 1e4), "#009e73", 0.3),
                     ("stars", file["PartType4/Coordinates"][:], 0.3 * np.sqrt(file["PartType4/Masses"][:] * 1e6), "#000000", 0.3)]
        for axis, (name, x, size, colour, alpha) in zip(line, parts):
            axis.scatter(x[:, 0], x[:, 2], s=size, color=colour, alpha=alpha, linewidths=0)
            axis.set(xlim=(-half, half), ylim=(-half, half), title=f"{name}, {time:.0f} Myr")
            axis.grid(False)
    figure.supxlabel("x [kpc]")
    figure.supylabel("z [kpc]")
    runs.save(figure, out / "dwarf_phases.png")


def potential_energy(mass, pos, soft, big_g):
    """Direct sum with Plummer's softening; of a pair that of the mean square."""
    total = 0.0
    for i in range(0, len(mass), 256):
        k = slice(i, i + 256)
        r2 = np.zeros((len(mass[k]), len(mass)))
        for axis in range(3):
            r2 += (pos[k, axis, None] - pos[None, :, axis]) ** 2
        r2 += 0.5 * (soft[k, None] ** 2 + soft[None, :] ** 2)
        inverse = 1 / np.sqrt(r2)
        inverse[np.arange(len(mass[k])), np.arange(i, i + len(mass[k]))] = 0
        total -= 0.5 * big_g * (mass[k] * (inverse @ mass)).sum()
    return total


def of_rows(path, big_g, softening):
    """Masses, elements, momentum and energies of a snapshot's rows."""
    sums = {"mass": 0.0, "metals": 0.0, "oxygen": 0.0, "iron": 0.0, "kinetic": 0.0, "thermal": 0.0}
    mass, pos, soft = [], [], []
    with h5py.File(path) as file:
        for number, kind in KINDS.items():
            if f"PartType{number}" not in file:
                continue
            rows = file[f"PartType{number}"]
            m, v = rows["Masses"][:].astype(float), rows["Velocities"][:]
            sums["mass"] += m.sum()
            sums["kinetic"] += 0.5 * (m * (v ** 2).sum(1)).sum()
            for name, column in (("metals", "Metallicity"), ("oxygen", "OxygenFraction"), ("iron", "IronFraction")):
                if column in rows:
                    sums[name] += (m * rows[column][:].astype(float)).sum()
            if kind == "gas":
                sums["thermal"] = (m * rows["InternalEnergy"][:].astype(float)).sum()
            mass.append(m)
            pos.append(rows["Coordinates"][:])
            soft.append(np.full(len(m), softening[kind == "dark"]))
    sums["potential"] = potential_energy(np.concatenate(mass), np.concatenate(pos), np.concatenate(soft), big_g)
    return sums


def at_time(table, time):
    return {name: column[np.argmin(abs(table["t"] - time))] for name, column in table.items()}


def books(run, big_g, softening):
    energy, budget = runs.table(run / "energy.csv"), runs.table(run / "budget.csv")
    own = ("t", "dt", "active", "kinetic", "thermal", "potential", "total", "error")
    reservoirs = [name for name in energy if name not in own and not name.startswith(("momentum", "angular", "mass_"))]
    found, first, largest = runs.snapshots(run), None, energy["kinetic"].max()
    print("t [Myr]  mass      metals    oxygen    iron      energy    (energy.csv) over the largest kinetic energy")
    for i in np.linspace(0, len(found) - 1, 6).round().astype(int):
        time, path = found[i]
        rows, told, made = of_rows(path, big_g, softening), at_time(energy, time), at_time(budget, time)
        suns = 1e10
        now = {"mass": rows["mass"], "energy": rows["kinetic"] + rows["thermal"] + rows["potential"]
               + sum(told[name] for name in reservoirs), "told": told["total"]}
        for name in ("metals", "oxygen", "iron"):
            now[name] = rows[name] - made[name + "_made"] / suns
        first = first or dict(now)
        off = {name: (now[name] - first[name]) / first[name] for name in ("mass", "metals", "oxygen", "iron")}
        print(f"{time * GYR * 1e3:7.0f}  " + "  ".join(f"{value:8.1e}" for value in off.values())
              + f"  {(now['energy'] - first['energy']) / largest:9.2e} ({(now['told'] - first['told']) / largest:.2e})")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run", metavar="RUN_DIR", nargs="+")
    parser.add_argument("--labels", nargs="+", help="of the runs (default: their folders' names)")
    parser.add_argument("--out", help="folder for what is written (default: the first run)")
    parser.add_argument("--softening", nargs=2, type=float, default=(0.1, 0.3), help="kpc: of all but the halo, of the halo")
    options = parser.parse_args()
    found = [runs.folder(run) for run in options.run]
    labels = options.labels or [run.name for run in found]
    if len(labels) != len(found):
        runs.stop("--labels: one for each run")
    out = Path(options.out or found[0])
    chart([series(run) for run in found], labels, out)
    pictures(found[0], out)
    books(found[0], 43009.172706, options.softening)


if __name__ == "__main__":
    main()
