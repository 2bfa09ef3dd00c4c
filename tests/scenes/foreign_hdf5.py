#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""foreign_hdf5.py arepo|swift|comoving|scaled|swift-comoving FILE: the same four rows of gas and two of dark matter, as
these programs would write them, in units of their own. In kpc, 1e10 Msun, km/s: x = (1, 2, 3) k, v = (10, 20, 30) k, m = 0.5,
u = 100 k, for the k-th of all. The last three are as of cosmological runs at z = 1 with h = 0.5: GADGET-2's convention, data
sets that tell their powers of a and h with another one, SWIFT."""
import sys

import h5py
import numpy as np

KPC, SUN, KMS = 3.0856775814913673e21, 1.988409870698051e43, 1e5
k = np.arange(1.0, 7)
x, v, u = np.outer(k, [1, 2, 3]), np.outer(k, [10, 20, 30]), 100 * k


A, H = 0.5, 0.5


def tell(f, powers):
    """Attributes of the data sets: powers of a and, where there are two, of h."""
    for t in (0, 1):
        for name, data in f[f"PartType{t}"].items():
            names = ("a_scaling", "h_scaling") if len(powers[name]) > 1 else ("a-scale exponent",)
            for attribute, power in zip(names, powers[name]):
                data.attrs[attribute] = power


def comoving(code, f, head):
    if code == "swift-comoving":        # Mpc, 1e10 Msun, 100 km/s; velocities peculiar, u comoving
        unit = f.create_group("Units").attrs
        for name, value in (("Unit length in cgs (U_L)", 1e3 * KPC), ("Unit mass in cgs (U_M)", SUN),
                            ("Unit time in cgs (U_t)", 1e3 * KPC / KMS / 100)):
            unit[name] = np.array([value])
        cosmology = f.create_group("Cosmology").attrs
        cosmology["Cosmological run"], cosmology["Scale-factor"], cosmology["h"] = np.array([1]), np.array([A]), np.array([H])
        head["Time"], head["BoxSize"] = np.array([0.3]), np.zeros(3)
        groups(f, 1e3 * A, 1, 100, ("InternalEnergies", "SmoothingLengths", 0.7), True, 1 / A)
        tell(f, {"Coordinates": [1.0], "Velocities": [0.0], "Masses": [0.0], "ParticleIDs": [0.0], "InternalEnergies": [-2.0],
                 "SmoothingLengths": [1.0]})
        return
    head["Time"], head["BoxSize"], head["Redshift"], head["OmegaLambda"], head["HubbleParam"] = A, 0.0, 1 / A - 1, 0.7, H
    head["UnitLength_in_cm"], head["UnitMass_in_g"], head["UnitVelocity_in_cm_per_s"] = KPC, SUN, KMS
    if code == "comoving":
        head["MassTable"] = np.array([0.5, 0.5, 0, 0, 0, 0]) * H
        groups(f, A / H, 1 / H, A ** 0.5, ("InternalEnergy", "SmoothingLength", 1.4), False, A ** -0.5)
    else:
        groups(f, A / H, 1 / H, 1, ("InternalEnergy", "SmoothingLength", 1.4), True)
        tell(f, {"Coordinates": [1, -1], "Velocities": [0, 0], "Masses": [0, -1], "ParticleIDs": [0, 0], "InternalEnergy": [0, 0],
                 "SmoothingLength": [1, -1]})


def groups(f, length, mass, velocity, names, m, more=1):
    for t, rows in ((0, slice(0, 4)), (1, slice(4, 6))):
        g = f.create_group(f"PartType{t}")
        g["Coordinates"] = x[rows] / length
        g["Velocities"] = (v[rows] / velocity).astype("f4")
        g["ParticleIDs"] = k[rows].astype("u4")
        if m:
            g["Masses"] = (0.5 + 0 * k[rows]) / mass
        if t == 0:
            g[names[0]] = u[rows] / (velocity * more) ** 2
            g[names[1]] = np.full(4, names[2]) / length


with h5py.File(sys.argv[2], "w") as f:
    head = f.create_group("Header").attrs
    head["NumPart_ThisFile"] = np.array([4, 2, 0, 0, 0, 0], "i4")
    head["NumFilesPerSnapshot"] = 1
    if "comoving" in sys.argv[1] or sys.argv[1] == "scaled":
        comoving(sys.argv[1], f, head)
    elif sys.argv[1] == "arepo":          # pc, Msun, km/s; masses in the header, cells without a smoothing length
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
