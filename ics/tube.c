/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two uniform states of gas that touch in a plane: Riemann's problem, of which Sod's (1978, J. Comput. Phys.
 * 27, 1) is the default. Each half is filled with a lattice of its own, rows in proportion to the masses; the right
 * one is mirrored, so that halves of equal density meet row by row and what is symmetric remains so. */
#include "lattice.h"
#include "module.h"
#include "rows.h"
#include <math.h>

enum { LEFT, RIGHT };

struct tube { double rho[2], p[2], v[2], length; };

#define SIDE(side, k, rho_, p_) \
    {"density_" side, PARAM_REAL, "density", rho_, 1e-300, 1e300, NULL, "density " side " of the middle", false, \
     offsetof(struct tube, rho) + k * sizeof(double)}, \
    {"pressure_" side, PARAM_REAL, "pressure", p_, 1e-300, 1e300, NULL, \
     "pressure; without a meaning for isothermal gas", false, offsetof(struct tube, p) + k * sizeof(double)}, \
    {"velocity_" side, PARAM_REAL, "velocity", "0", -1e300, 1e300, NULL, "velocity along x", false, \
     offsetof(struct tube, v) + k * sizeof(double)}

static const struct param params[] = {
    SIDE("left", 0, "1", "1"), SIDE("right", 1, "0.125", "0.1"),
    {"length", PARAM_REAL, "length", "none", 1e-300, 1e300, NULL, "extent of the gas along x; default: box.x", false,
     offsetof(struct tube, length)},
    {0}
};

struct part { int half; int64_t from, n; };

static void fill(struct sim *sim, const struct tube *tube, struct part part, const double side[3])
{
    struct species *gas = &sim->species[GAS];
    const int half = part.half;
    const double gamma = sim_real(sim, "gamma", 5.0 / 3);
    lattice_box(part.n, side, gas->pos + part.from);
    for (int64_t i = part.from; i < part.from + part.n; i++) {
        if (half == RIGHT) gas->pos[i][0] = 2 * side[0] - gas->pos[i][0];
        gas->vel[i][0] = tube->v[half];
        gas->mass[i] = tube->rho[half] * side[0] * side[1] * side[2] / (double)part.n;
        if (gas->u) gas->u[i] = (float)(tube->p[half] / ((gamma - 1) * tube->rho[half]));
    }
}

static void tube_make(struct sim *sim, const void *state, int64_t n)
{
    const struct tube *tube = state;
    double side[3];
    if (!rows_box(sim, "tube", tube->length, side)) return;
    if (n < 2) {
        problems_add(&sim->problems, "start.n: a tube has at least 2 rows, one a side");
        return;
    }
    rows_make(sim, GAS, n, 1);
    int64_t left = llround((double)n * tube->rho[LEFT] / (tube->rho[LEFT] + tube->rho[RIGHT]));
    left = left < 1 ? 1 : left > n - 1 ? n - 1 : left;
    side[0] /= 2;
    fill(sim, tube, (struct part){LEFT, 0, left}, side);
    fill(sim, tube, (struct part){RIGHT, left, n - left}, side);
}

const struct generator tube_generator = {
    .name = "tube", .doc = "two uniform states of gas that touch in the middle of a box (Sod 1978)",
    .params = params, .state_bytes = sizeof(struct tube), .make = tube_make,
};
