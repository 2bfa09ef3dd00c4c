/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows of a generator: see rows.h. */
#include "rows.h"
#include "constants.h"
#include "layout.h"
#include <math.h>

struct species *rows_make(struct sim *sim, enum species_kind kind, int64_t n, double mass)
{
    struct species *table = &sim->species[kind];
    const enum column wanted[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id};
    for (size_t c = 0; c < sizeof wanted / sizeof *wanted; c++) species_need(table, wanted[c]);
    species_reserve(table, n);
    for (int64_t i = 0; i < n; i++) {
        table->mass[i] = mass / (double)n;
        table->id[i] = (uint64_t)i + 1;
    }
    table->n = table->n_own = n;
    return table;
}

/* Twice, since the first mean carries the rounding of a sum of large terms. */
static void subtract_mean(double (*x)[3], int64_t n)
{
    for (int pass = 0; pass < 2; pass++) {
        double sum[3] = {0};
        for (int64_t i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) sum[k] += x[i][k];
        for (int64_t i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) x[i][k] -= sum[k] / (double)n;
    }
}

void rows_centre(struct species *table)
{
    subtract_mean(table->pos, table->n);
    subtract_mean(table->vel, table->n);
}

void rows_set_u(struct species *table, double u)
{
    if (!species_has(table, COLUMN_u)) return;
    for (int64_t i = 0; i < table->n; i++) table->u[i] = (float)u;
}

void rows_set_temperature(struct sim *sim, double kelvin, double mu)
{
    double u = kelvin / layout_kelvin(sim);
    if (!isnan(mu)) {
        double particle = (sim_real(sim, "gamma", 5.0 / 3) - 1) * mu * CONST_M_PROTON;
        u = CONST_K_B * kelvin / particle / (sim->units.velocity * sim->units.velocity);
    }
    sim->kelvin = isnan(mu);
    rows_set_u(&sim->species[GAS], u);
}

bool rows_box(struct sim *sim, const char *generator, double length, double side[3])
{
    bool given = true;
    for (int k = 0; k < 3; k++) {
        side[k] = k == 0 && !isnan(length) ? length : sim->box.side[k];
        if (side[k] > 0) continue;
        problems_add(&sim->problems, "start.generator %s fills a box: give box.%c", generator, 'x' + k);
        given = false;
    }
    return given;
}
