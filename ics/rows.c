/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows of a generator: see rows.h. */
#include "rows.h"
#include "file/layout.h"
#include <math.h>

struct rows rows_add(struct sim *sim, enum species_kind kind, int64_t n, double mass)
{
    struct species *table = &sim->species[kind];
    const struct rows rows = {table, table->n, n};
    const enum column wanted[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id};
    for (size_t c = 0; c < sizeof wanted / sizeof *wanted; c++) species_need(table, wanted[c]);
    species_reserve(table, table->n + n);
    uint64_t id = 1;
    for_species(sim, s) id += (uint64_t)s->n;
    for (int64_t i = 0; i < n; i++) {
        table->mass[rows.first + i] = mass / (double)n;
        table->id[rows.first + i] = id + (uint64_t)i;
    }
    table->n = table->n_own = rows.first + n;
    return rows;
}

struct species *rows_make(struct sim *sim, enum species_kind kind, int64_t n, double mass)
{
    return rows_add(sim, kind, n, mass).table;
}

struct rows rows_all(struct species *table) { return (struct rows){table, 0, table->n}; }

void rows_share(int64_t n, int parts, const double *share, int64_t *count)
{
    double sum = 0, before = 0;
    for (int k = 0; k < parts; k++) sum += share[k];
    for (int k = 0; k < parts; k++) {
        double after = before + share[k];
        count[k] = (int64_t)floor((double)n * (after / sum) + 0.5) - (int64_t)floor((double)n * (before / sum) + 0.5);
        before = after;
    }
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

void rows_centre(struct rows rows)
{
    subtract_mean(rows.table->pos + rows.first, rows.n);
    rows_rest(rows);
}

void rows_rest(struct rows rows) { subtract_mean(rows.table->vel + rows.first, rows.n); }

double rows_mass(const struct rows_spectrum *spectrum, double x)
{
    double power = spectrum->slope + 1, ratio = spectrum->most / spectrum->least;
    if (!(ratio > 1)) return spectrum->least;
    if (fabs(power) < 1e-9) return spectrum->least * pow(ratio, x);
    return spectrum->least * pow(1 + x * (pow(ratio, power) - 1), 1 / power);
}

void rows_set_u(struct species *table, double u)
{
    if (!species_has(table, COLUMN_u)) return;
    for (int64_t i = 0; i < table->n; i++) table->u[i] = (float)u;
}

void rows_set_temperature(struct sim *sim, double kelvin)
{
    sim->kelvin = true;
    rows_set_u(&sim->species[GAS], kelvin / layout_kelvin(sim));
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
