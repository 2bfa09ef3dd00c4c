/* SPDX-License-Identifier: GPL-3.0-or-later
 * Even gas at rest that fills a box: what cooling, heating and pairing are tested on. In physical units its
 * state may be given as n_H and T. */
#include "constants.h"
#include "lattice.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct medium { double rho, u, n_h, temperature, hydrogen, jitter; };

static const struct param params[] = {
    {"density", PARAM_REAL, "density", "none", 1e-300, 1e300, NULL, "density; or give n_h", false, offsetof(struct medium, rho)},
    {"u", PARAM_REAL, "specific_energy", "none", 1e-300, 1e300, NULL, "specific internal energy; or give temperature", false,
     offsetof(struct medium, u)},
    {"n_h", PARAM_REAL, "number_density", "none", 1e-300, 1e300, NULL, "hydrogen nuclei in a volume", false,
     offsetof(struct medium, n_h)},
    {"temperature", PARAM_REAL, "temperature", "none", 1e-3, 1e12, NULL, "temperature", false,
     offsetof(struct medium, temperature)},
    {"hydrogen", PARAM_REAL, "", CONST_TEXT(CONST_HYDROGEN), 0.01, 1, NULL, "part of the mass that is hydrogen, for n_h", false,
     offsetof(struct medium, hydrogen)},
    {"jitter", PARAM_REAL, "", "0", 0, 1, NULL, "rows are displaced by up to this part of their spacing along each axis", false,
     offsetof(struct medium, jitter)},
    {0}
};

/* One of a pair is given, the second only where there are units. */
static bool one_of(struct sim *sim, double first, double second, const char *names)
{
    if (isnan(first) != isnan(second) && (isnan(second) || sim->units.physical)) return true;
    problems_add(&sim->problems, "start: a medium needs one of %s%s", names,
                 sim->units.physical ? "" : ", the first in a scene without units");
    return false;
}

/* Displaces each row, by its id alone, and keeps it in the box. */
static void shake(struct sim *sim, struct species *gas, double most, const double side[3])
{
    const uint64_t stream = random_stream("medium");
    for (int64_t i = 0; i < gas->n; i++) {
        const struct random key = {sim->seed, gas->id[i], 0, stream};
        for (int k = 0; k < 3; k++) {
            double x = gas->pos[i][k] + most * (2 * random_uniform(&key, (uint64_t)k) - 1);
            gas->pos[i][k] = x - side[k] * floor(x / side[k]);
        }
    }
}

static void medium_make(struct sim *sim, const void *state, int64_t n)
{
    const struct medium *medium = state;
    double side[3];
    bool given = one_of(sim, medium->rho, medium->n_h, "density and n_h");
    given &= one_of(sim, medium->u, medium->temperature, "u and temperature");
    if (!rows_box(sim, "medium", NAN, side) || !given) return;
    double proton = CONST_M_PROTON / sim->units.mass;
    double rho = isnan(medium->rho) ? medium->n_h * proton / medium->hydrogen : medium->rho;
    struct species *gas = rows_make(sim, GAS, n, rho * side[0] * side[1] * side[2]);
    lattice_box(n, side, gas->pos);
    if (medium->jitter > 0) shake(sim, gas, medium->jitter * cbrt(side[0] * side[1] * side[2] / (double)n), side);
    if (isnan(medium->u)) rows_set_temperature(sim, medium->temperature);
    else rows_set_u(gas, medium->u);
}

const struct generator medium_generator = {
    .name = "medium", .doc = "even gas at rest that fills a box",
    .params = params, .state_bytes = sizeof(struct medium), .make = medium_make,
};
