#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""foreign_hdf5.py arepo|swift FILE: the same four rows of gas and two of dark matter, as these programs would write them, in
units of their own. In kpc, 1e10 Msun, km/s: x = (1, 2, 3) k, v = (10, 20, 30) k, m = 0.5, u = 100 k, for the k-th of all."""
import sys

import h5py
import numpy as np

KPC, SUN, KMS = 3.0856775814913673e21, 1.988409870698051e43, 1e5
k = np.arange(1.0, 7)
x, v, u = np.outer(k, [1, 2, 3]), np.outer(k, [10, 20, 30]), 100 * k


def groups(f, length, mass, velocity, names, m):
    for t, rows in ((0, slice(0, 4)), (1, slice(4, 6))):
        g = f.create_group(f"PartType{t}")
        g["Coordinates"] = x[rows] / length
        g["Velocities"] = (v[rows] / velocity).astype("f4")
        g["ParticleIDs"] = k[rows].astype("u4")
        if m:
            g["Masses"] = (0.5 + 0 * k[rows]) / mass
        if t == 0:
            g[names[0]] = u[rows] / velocity ** 2
            g[names[1]] = np.full(4, names[2]) / length


with h5py.File(sys.argv[2], "w") as f:
    head = f.create_group("Header").attrs
    head["NumPart_ThisFile"] = np.array([4, 2, 0, 0, 0, 0], "i4")
    head["NumFilesPerSnapshot"] = 1
    if sys.argv[1] == "arepo":          # pc, Msun, km/s; masses in the header, cells without a smoothing length
        head["MassTable"] = np.array([0.5e10, 0.5e10, 0, 0, 0, 0])
        head["Time"], head["BoxSize"], head["Redshift"], head["OmegaLambda"], head["HubbleParam"] = 2000.0, 0.0, 0.0, 0.0, 1.0
        head["UnitLength_in_cm"], head["UnitMass_in_g"], head["UnitVelocity_in_cm_per_s"] = KPC / 1e3, SUN / 1e10, KMS
        groups(f, 1e-3, 1e-10, 1, ("InternalEnergy", "Volume", 1.0), False)
    else:                               # Mpc, 1e10 Msun, Mpc/Gyr
        time = 1e3 * KPC / KMS / 100    # one unit of velocity is 100 km/s
        head["Time"], head["BoxSize"], head["Dimension"] = np.array([2 / 10]), np.zeros(3), 3
        unit = f.create_group("Units").attrs
        for name, value in (("Unit length in cgs (U_L)", 1e3 * KPC), ("Unit mass in cgs (U_M)", SUN),
                            ("Unit time in cgs (U_t)", time), ("Unit current in cgs (U_I)", 1), ("Unit temperature in cgs (U_T)", 1)):
            unit[name] = np.array([value])
        cosmology = f.create_group("Cosmology").attrs
        cosmology["Cosmological run"], cosmology["Scale-factor"] = np.array([0]), np.array([1.0])
        groups(f, 1e3, 1, 100, ("InternalEnergies", "SmoothingLengths", 0.7), True)
