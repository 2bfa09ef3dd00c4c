/* SPDX-License-Identifier: GPL-3.0-or-later
 * A strong explosion in even gas at rest (Sedov 1959): energy in the few rows nearest to the middle of
 * a box. One row lies in the middle, and rows that are equally far from it share alike. */
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "rows.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct sedov { double rho, energy, u; int64_t hot; };

static const struct param params[] = {
    {"density", PARAM_REAL, "density", "1", 1e-300, 1e300, NULL, "density of the gas", false, offsetof(struct sedov, rho)},
    {"energy", PARAM_REAL, "energy", "1", 0, 1e300, NULL, "energy of the explosion", false, offsetof(struct sedov, energy)},
    {"u", PARAM_REAL, "specific_energy", "1e-6", 1e-300, 1e300, NULL, "specific internal energy of the gas around", false,
     offsetof(struct sedov, u)},
    {"hot", PARAM_COUNT, "", "32", 1, 1e9, NULL, "rows that hold the energy at the start, at least", false,
     offsetof(struct sedov, hot)},
    {0}
};

static double distance2(const double side[3], const double pos[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (pos[k] - 0.5 * side[k]) * (pos[k] - 0.5 * side[k]);
    return sum;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Squared distance within which there are `hot` rows, a little more than that of the last of them. */
static double reach2(const struct species *gas, const double side[3], int64_t hot)
{
    double *r2 = mem_array("generator", double, gas->n);
    for (int64_t i = 0; i < gas->n; i++) r2[i] = distance2(side, gas->pos[i]);
    qsort(r2, (size_t)gas->n, sizeof *r2, compare);
    double last = r2[(hot < gas->n ? hot : gas->n) - 1];
    mem_free(r2);
    return last * (1 + 1e-9);
}

static void sedov_make(struct sim *sim, const void *state, int64_t n)
{
    const struct sedov *sedov = state;
    double side[3], first[3];
    if (!rows_box(sim, "sedov", NAN, side)) return;
    struct species *gas = rows_make(sim, GAS, n, sedov->rho * side[0] * side[1] * side[2]);
    lattice_box(n, side, gas->pos);
    memcpy(first, gas->pos[0], sizeof first);
    for (int64_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) gas->pos[i][k] += 0.5 * side[k] - first[k];
        box_wrap(&sim->box, gas->pos[i]);
    }
    rows_set_u(gas, sedov->u);
    if (!gas->u) return;
    double limit = reach2(gas, side, sedov->hot);
    int64_t count = 0;
    for (int64_t i = 0; i < n; i++) count += distance2(side, gas->pos[i]) <= limit;
    for (int64_t i = 0; i < n; i++)
        if (distance2(side, gas->pos[i]) <= limit) gas->u[i] += (float)(sedov->energy / ((double)count * gas->mass[i]));
}

const struct generator sedov_generator = {
    .name = "sedov", .doc = "an explosion in the middle of a box of even gas (Sedov 1959)",
    .params = params, .state_bytes = sizeof(struct sedov), .make = sedov_make,
};
