/* SPDX-License-Identifier: GPL-3.0-or-later
 * Even gas at rest that fills a box, and stars of one age at random places in it: what the return of
 * stars to the gas is tested on. */
#include "constants.h"
#include "lattice.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct ssp { double n_h, hydrogen, temperature, star_mass; int64_t stars; };

static const struct param params[] = {
    {"n_h", PARAM_REAL, "number_density", NULL, 1e-300, 1e300, NULL, "hydrogen nuclei in a volume", false,
     offsetof(struct ssp, n_h)},
    {"hydrogen", PARAM_REAL, "", "0.71", 0.01, 1, NULL, "part of the mass of gas that is hydrogen", false,
     offsetof(struct ssp, hydrogen)},
    {"temperature", PARAM_REAL, "temperature", "1e6", 1e-3, 1e12, NULL,
     "temperature of the gas, with the mean molecular weight of `cooling`, else 0.6", false, offsetof(struct ssp, temperature)},
    {"stars", PARAM_COUNT, "", "10", 0, 1e9, NULL, "how many of the rows are stars", false, offsetof(struct ssp, stars)},
    {"star_mass", PARAM_REAL, "mass", NULL, 0, 1e300, NULL, "mass of each row of stars, of age 0", false,
     offsetof(struct ssp, star_mass)},
    {0}
};

static void ssp_make(struct sim *sim, const void *state, int64_t n)
{
    const struct ssp *ssp = state;
    double side[3], volume = 1;
    if (!sim->units.physical || ssp->stars >= n)
        problems_add(&sim->problems, "start: ssp needs physical units, and fewer stars than start.n");
    if (!rows_box(sim, "ssp", NAN, side) || sim->problems.count > 0) return;
    for (int k = 0; k < 3; k++) volume *= side[k];
    double rho = ssp->n_h * CONST_M_PROTON / sim->units.mass / ssp->hydrogen;
    struct species *gas = rows_make(sim, GAS, n - ssp->stars, rho * volume);
    lattice_box(gas->n, side, gas->pos);
    rows_set_temperature(sim, ssp->temperature);
    if (ssp->stars == 0) return;
    struct species *star = rows_make(sim, STAR, ssp->stars, (double)ssp->stars * ssp->star_mass);
    for (int64_t i = 0; i < star->n; i++) {
        star->id[i] = (uint64_t)(gas->n + i + 1);
        const struct random key = {sim->seed, star->id[i], 0, random_stream("ssp")};
        for (int k = 0; k < 3; k++) star->pos[i][k] = side[k] * random_uniform(&key, (uint64_t)k);
    }
}

const struct generator ssp_generator = {
    .name = "ssp", .doc = "even gas that fills a box, and stars of age 0 in it",
    .params = params, .state_bytes = sizeof(struct ssp), .make = ssp_make,
};
