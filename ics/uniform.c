/* SPDX-License-Identifier: GPL-3.0-or-later
 * A sphere of even density, rows at random places, at rest or with normal velocities whose kinetic
 * energy is the part `virial` of the potential energy 3/5 G M^2 / R. Each row comes from its id alone. */
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct uniform { double mass, radius, virial, u; int species; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-300, 1e300, NULL, "mass of the sphere", false, offsetof(struct uniform, mass)},
    {"radius", PARAM_REAL, "length", "1", 1e-300, 1e300, NULL, "radius of the sphere", false,
     offsetof(struct uniform, radius)},
    {"virial", PARAM_REAL, "", "0", 0, 1e6, NULL,
     "kinetic energy of random motion over potential energy: 0 is at rest, 0.5 in equilibrium", false,
     offsetof(struct uniform, virial)},
    {"species", PARAM_CHOICE, "", "dark", 0, 0, "dark|star|gas", "what the rows are", false,
     offsetof(struct uniform, species)},
    {"u", PARAM_REAL, "specific_energy", "none", 0, 1e30, NULL,
     "specific internal energy of gas; default: 0.05 G mass / radius", false, offsetof(struct uniform, u)},
    {0}
};

static const enum species_kind kinds[] = {DARK, STAR, GAS};

static void uniform_make(struct sim *sim, const void *state, int64_t n)
{
    const struct uniform *uniform = state;
    const double depth = sim->units.G * uniform->mass / uniform->radius;
    const double sigma = sqrt(0.4 * uniform->virial * depth);   /* 3/2 M sigma^2 = virial 3/5 G M^2 / R */
    const uint64_t stream = random_stream("uniform");
    struct species *table = rows_make(sim, kinds[uniform->species], n, uniform->mass);
#pragma omp parallel for
    for (int64_t i = 0; i < n; i++) {
        const struct random key = {sim->seed, table->id[i], 0, stream};
        double r = uniform->radius * cbrt(random_uniform(&key, 0));
        random_direction(&key, 1, table->pos[i]);
        for (int k = 0; k < 3; k++) {
            table->pos[i][k] *= r;
            if (sigma > 0.0) table->vel[i][k] = sigma * random_normal(&key, 2 + (uint64_t)k);
        }
    }
    rows_centre(rows_all(table));
    rows_set_u(table, isnan(uniform->u) ? 0.05 * depth : uniform->u);
}

const struct generator uniform_generator = {
    .name = "uniform", .doc = "sphere of even density, at rest or with random velocities",
    .params = params, .state_bytes = sizeof(struct uniform), .make = uniform_make,
};
