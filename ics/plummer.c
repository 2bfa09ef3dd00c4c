/* SPDX-License-Identifier: GPL-3.0-or-later
 * Plummer's sphere in equilibrium, sampled as Aarseth, Henon & Wielen (1974, A&A 37, 183) do:
 * M(r) = M / (1 + (r0/r)^2)^(3/2); the velocity, in units of that of escape, has the density
 * g(q) = q^2 (1 - q^2)^(7/2) and no direction. Each row is made from its id alone. */
#include "holes.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct plummer { double mass, radius, cut, virial; int species; struct holes holes; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-300, 1e300, NULL, "mass of the model out to infinity", false,
     offsetof(struct plummer, mass)},
    {"radius", PARAM_REAL, "length", "0.5890486225480862", 1e-300, 1e300, NULL,
     "Plummer's radius r0; the default, 3 pi/16, makes the energy -1/4 for G = mass = 1", false,
     offsetof(struct plummer, radius)},
    {"cut", PARAM_REAL, "length", "none", 1e-300, 1e300, NULL,
     "no row lies farther out; the rows then hold the model's mass within", false, offsetof(struct plummer, cut)},
    {"virial", PARAM_REAL, "", "1", 0, 2, NULL,
     "virial ratio 2T/|W|: 1 in equilibrium, 0 at rest, in between all velocities lessened alike", false,
     offsetof(struct plummer, virial)},
    {"species", PARAM_CHOICE, "", "dark", 0, 0, "dark|star", "what the rows are", false,
     offsetof(struct plummer, species)},
    HOLES_PARAMS(struct plummer, holes),
    {0}
};

static const enum species_kind kinds[] = {DARK, STAR};

/* By rejection: g(q) is below 0.1 everywhere (its maximum is 0.092 at q^2 = 2/9). */
static double escape_fraction(const struct random *key)
{
    for (uint64_t draw = 6;; draw += 2) {
        double q = random_uniform(key, draw), left = 1.0 - q * q;
        if (0.1 * random_uniform(key, draw + 1) < q * q * left * left * left * sqrt(left)) return q;
    }
}

static void plummer_make(struct sim *sim, const void *state, int64_t n)
{
    const struct plummer *plummer = state;
    const double r0 = plummer->radius, GM = sim->units.G * plummer->mass;
    const double part = isnan(plummer->cut) ? 1.0 : pow(1.0 + r0 * r0 / (plummer->cut * plummer->cut), -1.5);
    const uint64_t stream = random_stream("plummer");
    n = holes_reserve(sim, &plummer->holes, n);
    if (n == 0) return;
    struct species *table = rows_make(sim, kinds[plummer->species], n, part * plummer->mass);
#pragma omp parallel for
    for (int64_t i = 0; i < n; i++) {
        const struct random key = {sim->seed, table->id[i], 0, stream};
        double inside = part * random_uniform(&key, 0);     /* the part of the mass within r */
        double r = r0 / sqrt(expm1(-2.0 / 3.0 * log(inside)));
        double v = escape_fraction(&key) * sqrt(2.0 * plummer->virial * GM / sqrt(r * r + r0 * r0));
        random_direction(&key, 1, table->pos[i]);
        random_direction(&key, 2, table->vel[i]);
        for (int k = 0; k < 3; k++) {
            table->pos[i][k] *= r;
            table->vel[i][k] *= v;
        }
    }
    rows_centre(rows_all(table));
    const double d = plummer->holes.distance;
    holes_make(sim, &plummer->holes, plummer->holes.n > 1 ? plummer->mass * pow(1 + r0 * r0 / (d * d), -1.5) : 0);
}

const struct generator plummer_generator = {
    .name = "plummer", .doc = "Plummer's sphere of dark matter or stars, in equilibrium or colder",
    .params = params, .state_bytes = sizeof(struct plummer), .make = plummer_make,
};
