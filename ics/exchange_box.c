/* SPDX-License-Identifier: GPL-3.0-or-later
 * Even gas that fills a box, and cold clouds at random places in it that move through it: what the exchange between them is
 * tested on. */
#include "constants.h"
#include "lattice.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct exchange_box { double n, mu, temperature, mass, speed; int64_t clouds; };

static const struct param params[] = {
    {"density", PARAM_REAL, "number_density", NULL, 1e-300, 1e300, NULL, "particles of gas in a volume", false,
     offsetof(struct exchange_box, n)},
    {"mu", PARAM_REAL, "", "0.61", 0.1, 10, NULL, "mean molecular weight of the gas", false, offsetof(struct exchange_box, mu)},
    {"temperature", PARAM_REAL, "temperature", NULL, 1e-3, 1e12, NULL, "of the gas", false,
     offsetof(struct exchange_box, temperature)},
    {"clouds", PARAM_COUNT, "", "1", 0, 1e9, NULL, "how many of the rows are clouds", false, offsetof(struct exchange_box, clouds)},
    {"mass", PARAM_REAL, "mass", "1e5 Msun", 1e-300, 1e300, NULL, "mass of each cloud", false, offsetof(struct exchange_box, mass)},
    {"speed", PARAM_REAL, "velocity", "0", 0, 1e300, NULL, "of each cloud along x", false, offsetof(struct exchange_box, speed)},
    {0}
};

static void exchange_box_make(struct sim *sim, const void *state, int64_t n)
{
    const struct exchange_box *box = state;
    double side[3];
    if (!sim->units.physical || box->clouds >= n)
        problems_add(&sim->problems, "start: exchange_box needs physical units, and fewer clouds than start.n");
    if (!rows_box(sim, "exchange_box", NAN, side) || sim->problems.count > 0) return;
    double rho = box->n * box->mu * CONST_M_PROTON / sim->units.mass;
    struct species *gas = rows_make(sim, GAS, n - box->clouds, rho * side[0] * side[1] * side[2]);
    lattice_box(gas->n, side, gas->pos);
    rows_set_u(gas, CONST_K_B * box->temperature / ((sim_real(sim, "gamma", 5.0 / 3) - 1) * box->mu * CONST_M_PROTON) /
                        (sim->units.velocity * sim->units.velocity));
    if (box->clouds == 0) return;
    struct rows rows = rows_add(sim, CLOUD, box->clouds, (double)box->clouds * box->mass);
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {sim->seed, rows.table->id[i], 0, random_stream("exchange_box")};
        for (int k = 0; k < 3; k++) rows.table->pos[i][k] = side[k] * random_uniform(&key, (uint64_t)k);
        rows.table->vel[i][0] = box->speed;
    }
}

const struct generator exchange_box_generator = {
    .name = "exchange_box", .doc = "even gas that fills a box, and cold clouds in it",
    .params = params, .state_bytes = sizeof(struct exchange_box), .make = exchange_box_make,
};
