/* SPDX-License-Identifier: GPL-3.0-or-later
 * A cuspy halo with subclumps, at rest: a test of gravity with steep densities. Halo and clumps are
 * spheres of Hernquist (1990), M(r) = M r^2 / (r + a)^2, cut where nine tenths of the mass of a clump
 * and 0.98 of that of the halo lie within; the clumps' centres are drawn from the halo, their scales evenly in
 * the logarithm between a hundredth and a tenth of the halo's. Each row is made from its id alone. */
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct clumped { double mass, radius, fraction; int64_t clumps; int species; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-30, 1e30, NULL, "mass of all rows", false, offsetof(struct clumped, mass)},
    {"radius", PARAM_REAL, "length", "1", 1e-30, 1e30, NULL, "scale radius of the halo", false,
     offsetof(struct clumped, radius)},
    {"fraction", PARAM_REAL, "", "0.1", 0, 1, NULL, "part of the mass in clumps", false,
     offsetof(struct clumped, fraction)},
    {"clumps", PARAM_COUNT, "", "50", 1, 1000000, NULL, "number of clumps", false, offsetof(struct clumped, clumps)},
    {"species", PARAM_CHOICE, "", "dark", 0, 0, "dark|star", "what the rows are", false,
     offsetof(struct clumped, species)},
    {0}
};

static const enum species_kind kinds[] = {DARK, STAR};

/* A place in Hernquist's sphere of scale radius a; `part` of its mass lies within the cut. */
static void place(const struct random *key, uint64_t draw, double a, double part, double pos[3])
{
    double root = sqrt(part * random_uniform(key, draw)), r = a * root / (1 - root);
    random_direction(key, draw + 1, pos);
    for (int k = 0; k < 3; k++) pos[k] *= r;
}

static void clumped_make(struct sim *sim, const void *state, int64_t n)
{
    const struct clumped *c = state;
    const uint64_t stream = random_stream("clumped"), centres = random_stream("clumped_centres");
    struct species *table = rows_make(sim, kinds[c->species], n, c->mass);
#pragma omp parallel for
    for (int64_t i = 0; i < n; i++) {
        const struct random key = {sim->seed, table->id[i], 0, stream};
        if (random_uniform(&key, 0) >= c->fraction) {
            place(&key, 1, c->radius, 0.98, table->pos[i]);
            continue;
        }
        const struct random clump = {sim->seed, (uint64_t)(random_uniform(&key, 5) * (double)c->clumps), 0, centres};
        double centre[3];
        place(&clump, 0, c->radius, 0.98, centre);
        place(&key, 1, c->radius * pow(10, -2 + random_uniform(&clump, 5)), 0.9, table->pos[i]);
        for (int k = 0; k < 3; k++) table->pos[i][k] += centre[k];
    }
    rows_centre(rows_all(table));
}

const struct generator clumped_generator = {
    .name = "clumped", .doc = "cuspy halo with subclumps, at rest: a test of gravity",
    .params = params, .state_bytes = sizeof(struct clumped), .make = clumped_make,
};
