#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Radial momentum and energies of ics/supernova.yml: one line a snapshot of the run directory given.

Radii are from the middle of the box. Energies are of 1e51 erg, the thermal one beyond that of the gas around, which is
taken from the row farthest from the middle at the start."""
import glob
import sys
import h5py
import numpy as np

ERG51 = 1e51 / (1.98841e43 * 1e10)      # 1e51 erg in 1e10 Msun (km/s)^2

print("t_Myr,momentum_Msun_km_s,thermal,kinetic,hot_mass_Msun,hot_radius_pc,n_max_over_mean")
around = None
for path in sorted(glob.glob(sys.argv[1] + "/snapshot_*.hdf5")):
    with h5py.File(path) as file:
        gas, header = file["PartType0"], file["Header"].attrs
        side = np.atleast_1d(header["BoxSize"])[0]
        place = gas["Coordinates"][:] - side / 2
        velocity, mass = gas["Velocities"][:], gas["Masses"][:].astype(float)
        u, kelvin, rho = (gas[name][:].astype(float) for name in ("InternalEnergy", "Temperature", "Density"))
        time = header["Time"] * 977.79
    radius = np.sqrt((place**2).sum(axis=1))
    outward = (place * velocity).sum(axis=1) / np.maximum(radius, 1e-30)
    if around is None:
        around = u[np.argmax(radius)]
    hot = kelvin > 2e4
    print("%.4g,%.4g,%.3f,%.3f,%.4g,%.3g,%.3g" % (
        time, 1e10 * (mass * np.maximum(outward, 0)).sum(), (mass * (u - around)).sum() / ERG51,
        0.5 * (mass * (velocity**2).sum(axis=1)).sum() / ERG51, 1e10 * mass[hot].sum(),
        1e3 * radius[hot].max() if hot.any() else 0, rho.max() * side**3 / mass.sum()))
