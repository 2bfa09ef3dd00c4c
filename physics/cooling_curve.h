/* SPDX-License-Identifier: GPL-3.0-or-later
 * Radiative cooling of gas at constant density, integrated exactly: du/dt = heating - rho Q(u), with
 * Q piecewise a power law in the specific energy u. Without heating the closed form of Townsend (2009,
 * ApJS 181, 391) on u: any step costs two powers. With heating gas walks towards the equilibrium on its
 * side (cooling_balance.h); it never steps over it. Everything in cgs: u in erg/g, Q in erg cm^3 g^-2 s^-1. */
#ifndef TEPHRA_COOLING_CURVE_H
#define TEPHRA_COOLING_CURVE_H
#include "cooling_advance.h"
#include "cooling_table.h"

/* What of the gas a curve is made for. NAN: the samples' own masses. */
struct cooling_gas {
    double gamma;
    double mu;                  /* mean mass of a particle in proton masses */
    double hydrogen;            /* mass fraction of hydrogen */
    double floor;               /* lowest temperature [K] */
    double heating;             /* erg/s per hydrogen nucleus */
};

struct cooling_curve *cooling_curve_new(const struct cooling_samples *samples, const struct cooling_gas *gas);
void cooling_curve_free(struct cooling_curve *curve);

double cooling_curve_u(const struct cooling_curve *curve, double t);
double cooling_curve_temperature(const struct cooling_curve *curve, double u);
/* Net du/dt at a density, negative where the gas cools. */
double cooling_curve_rate(const struct cooling_curve *curve, double u, double rho);

/* u after dt at density rho; at least the floor, to which colder gas is raised. */
double cooling_curve_advance(const struct cooling_curve *curve, double u, double rho, double dt);
#endif
