/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spherical components in equilibrium in the potential that they make together: distribution functions without
 * direction by Eddington's inversion (1916, MNRAS 76, 572; Binney & Tremaine 2008, eq. 4.46) for rows without
 * pressure, hydrostatic temperatures for gas. */
#ifndef TEPHRA_EQUILIBRIUM_H
#define TEPHRA_EQUILIBRIUM_H
#include "radial.h"
#include "rows.h"

enum { EQUILIBRIUM_POINTS = 2400, EQUILIBRIUM_PARTS = 6 };

/* What lies at each of many radii, evenly spaced in ln r. */
struct equilibrium {
    int n;
    struct radial part[EQUILIBRIUM_PARTS];
    double G, first, step;      /* ln of the first radius, and of the ratio of the next */
    double mass[EQUILIBRIUM_POINTS];    /* all parts within r */
    double rho[EQUILIBRIUM_POINTS];     /* their density */
    double psi[EQUILIBRIUM_POINTS];     /* minus the potential: falls outwards */
};

/* One part that rows are drawn from. */
struct equilibrium_part {
    const struct equilibrium *all;
    const struct radial *profile;
    double total;                       /* its mass */
    double mass[EQUILIBRIUM_POINTS];    /* ln of its mass within r over its total */
    double f[EQUILIBRIUM_POINTS];       /* distribution function at the energy psi, per unit of total mass */
    double most[EQUILIBRIUM_POINTS];    /* largest q^2 f(psi (1 - q^2)) at r */
    double u[EQUILIBRIUM_POINTS];       /* gas: (gamma - 1) times the specific internal energy */
};

/* parts: n of them, with form, mass, radius and cut set. To be freed with mem_free. */
struct equilibrium *equilibrium_new(double G, const struct radial *parts, int n);
/* Velocities: false if no distribution without direction makes part k, since f would be below zero somewhere. */
bool equilibrium_velocities(const struct equilibrium *all, int k, struct equilibrium_part *part);
/* Temperatures of part k as gas at rest. */
void equilibrium_temperatures(const struct equilibrium *all, int k, struct equilibrium_part *part);
/* Rows from their ids alone; stream: random_stream of a name. */
void equilibrium_fill(const struct equilibrium_part *part, struct rows rows, uint64_t seed, uint64_t stream);
/* Gas rows on a stretched lattice, at rest. */
void equilibrium_fill_gas(const struct equilibrium_part *part, struct rows rows, double gamma);
#endif
