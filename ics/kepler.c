/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two bodies on Kepler's orbits about their centre of mass, at their largest distance a (1 + e), where the
 * relative velocity is sqrt(G M/a (1 - e)/(1 + e)). The energy is -G m1 m2/(2 a), the period
 * 2 pi sqrt(a^3/(G M)). */
#include "module.h"
#include "rows.h"
#include <math.h>

struct kepler { double mass, axis, eccentricity, ratio; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-30, 1e30, NULL, "mass of both", false, offsetof(struct kepler, mass)},
    {"axis", PARAM_REAL, "length", "1", 1e-30, 1e30, NULL, "semi-major axis of the relative orbit", false,
     offsetof(struct kepler, axis)},
    {"eccentricity", PARAM_REAL, "", "0", 0, 0.9999, NULL, "eccentricity", false,
     offsetof(struct kepler, eccentricity)},
    {"ratio", PARAM_REAL, "", "1", 1e-10, 1, NULL, "mass of the second body over that of the first", false,
     offsetof(struct kepler, ratio)},
    {0}
};

static void kepler_make(struct sim *sim, const void *state, int64_t n)
{
    const struct kepler *kepler = state;
    if (n != 2) {
        problems_add(&sim->problems, "start.n = %lld: an orbit of kepler is of two bodies", (long long)n);
        return;
    }
    struct species *table = rows_make(sim, DARK, n, kepler->mass);
    const double e = kepler->eccentricity, a = kepler->axis;
    const double v = sqrt(sim->units.G * kepler->mass / a * (1 - e) / (1 + e));
    for (int i = 0; i < 2; i++) {
        double share = (i ? kepler->ratio : 1) / (1 + kepler->ratio), arm = i ? share - 1 : 1 - share;
        table->mass[i] = share * kepler->mass;
        table->pos[i][0] = arm * a * (1 + e);
        table->vel[i][1] = arm * v;
    }
}

const struct generator kepler_generator = {
    .name = "kepler", .doc = "two bodies on Kepler's orbits, at their largest distance",
    .params = params, .state_bytes = sizeof(struct kepler), .make = kepler_make,
};
