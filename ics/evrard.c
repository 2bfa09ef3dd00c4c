/* SPDX-License-Identifier: GPL-3.0-or-later
 * Evrard's (1988, MNRAS 235, 911) cold gas sphere: rho = M / (2 pi R^2 r) within R, at rest, with
 * u = 0.05 G M / R. The n innermost points of a face-centred cubic lattice, a ball of even density,
 * are stretched by r -> R (r / r_ball)^(3/2), which makes M(r) = M (r/R)^2 with little noise. */
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "rows.h"
#include <math.h>

struct evrard { double mass, radius, u; int places; };
enum { LATTICE, GLASS };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-300, 1e300, NULL, "mass of the sphere", false, offsetof(struct evrard, mass)},
    {"radius", PARAM_REAL, "length", "1", 1e-300, 1e300, NULL, "radius of the sphere", false,
     offsetof(struct evrard, radius)},
    {"u", PARAM_REAL, "specific_energy", "none", 0, 1e30, NULL,
     "specific internal energy; default: 0.05 G mass / radius", false, offsetof(struct evrard, u)},
    {"places", PARAM_CHOICE, "", "lattice", 0, 0, "lattice|glass",
     "of the rows, before they are stretched: a lattice is the most even, a glass has no axes", false,
     offsetof(struct evrard, places)},
    {0}
};

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static void evrard_make(struct sim *sim, const void *state, int64_t n)
{
    const struct evrard *evrard = state;
    struct species *gas = rows_make(sim, GAS, n, evrard->mass);
    double (*ball)[3] = evrard->places == GLASS ? lattice_glass_ball(n) : lattice_ball(n);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) gas->pos[i][k] = evrard->radius * sqrt(norm(ball[i])) * ball[i][k];
    mem_free(ball);
    rows_centre(rows_all(gas));
    rows_set_u(gas, isnan(evrard->u) ? 0.05 * sim->units.G * evrard->mass / evrard->radius : evrard->u);
}

const struct generator evrard_generator = {
    .name = "evrard", .doc = "cold gas sphere with rho ~ 1/r at rest, which collapses and bounces (Evrard 1988)",
    .params = params, .state_bytes = sizeof(struct evrard), .make = evrard_make,
};
