/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sums of energy.csv. */
#include "energy.h"
#include "comm.h"
#include "file/layout.h"
#include "file/series.h"
#include "mem.h"
#include "module.h"
#include "sum.h"
#include <math.h>
#include <stdio.h>

enum { KINETIC, THERMAL, POTENTIAL, FIXED };
enum { MASS = 1 + 3 + 3, SUMS = MASS + 1, BLOCK = 4096 };   /* kinetic, momentum, angular momentum, mass */

static void sum_row(const struct species *s, int64_t i, struct sum sum[SUMS])
{
    const double m = s->mass[i], *x = s->pos[i], *v = s->vel[i];
    sum_add(&sum[0], 0.5 * m * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    for (int k = 0; k < 3; k++) {
        int p = (k + 1) % 3, q = (k + 2) % 3;
        sum_add(&sum[1 + k], m * v[k]);
        sum_add(&sum[4 + k], m * (x[p] * v[q] - x[q] * v[p]));
    }
    sum_add(&sum[MASS], m);
}

/* Own rows of a species, block by block and the blocks in order: the same on any number of threads. */
static void sum_species(const struct species *s, struct sum sum[SUMS])
{
    int64_t blocks = (s->n_own + BLOCK - 1) / BLOCK;
    struct sum (*part)[SUMS] = mem_alloc("frame", (size_t)blocks * sizeof *part);
#pragma omp parallel for
    for (int64_t b = 0; b < blocks; b++)
        for (int64_t i = b * BLOCK; i < (b + 1) * BLOCK && i < s->n_own; i++) sum_row(s, s->own + i, part[b]);
    for (int64_t b = 0; b < blocks; b++)
        for (int k = 0; k < SUMS; k++) {
            sum_add(&sum[k], part[b][k].high);
            sum_add(&sum[k], part[b][k].low);
        }
    mem_free(part);
}

double energy_of_rows(const struct species *s, const float *specific)
{
    int64_t blocks = (s->n_own + BLOCK - 1) / BLOCK, end = s->own + s->n_own;
    struct sum *part = mem_alloc("frame", (size_t)blocks * sizeof *part), sum = {0, 0};
#pragma omp parallel for
    for (int64_t b = 0; b < blocks; b++)
        for (int64_t i = s->own + b * BLOCK; i < s->own + (b + 1) * BLOCK && i < end; i++)
            sum_add(&part[b], s->mass[i] * (double)specific[i]);
    for (int64_t b = 0; b < blocks; b++) {
        sum_add(&sum, part[b].high);
        sum_add(&sum, part[b].low);
    }
    mem_free(part);
    return sum_value(&sum);
}

struct collector { struct energy_sink sink; struct energy *energy; };

static void collect(struct energy_sink *sink, const char *column, double value)
{
    struct energy *energy = ((struct collector *)sink)->energy;
    for (int i = 0; i < energy->n; i++)
        if (strcmp(energy->name[i], column) == 0) {
            energy->value[i] += value;
            return;
        }
    check(energy->n < ENERGY_COLUMNS && strlen(column) < ENERGY_NAME);
    strcpy(energy->name[energy->n], column);
    energy->value[energy->n++] = value;
}

void energy_measure(struct sim *sim, struct energy *energy)
{
    struct sum sum[SUMS] = {{0, 0}};
    energy->n = 0;
    struct collector collector = {{collect}, energy};
    const char *const fixed[FIXED] = {"kinetic", "thermal", "potential"};
    for (int i = 0; i < FIXED; i++) collect(&collector.sink, fixed[i], 0);
    for (int k = 0; k < N_SPECIES; k++) {
        sum[MASS] = (struct sum){0, 0};
        if (sim->species[k].n_own > 0) sum_species(&sim->species[k], sum);
        energy->mass[k] = sum_value(&sum[MASS]);
    }
    collect(&collector.sink, fixed[KINETIC], sum_value(&sum[0]));
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->energy) sim->use[u].module->energy(sim, sim->use[u].state, &collector.sink);
    for (int k = 0; k < 3; k++) {
        energy->momentum[k] = sum_value(&sum[1 + k]);
        energy->angular_momentum[k] = sum_value(&sum[4 + k]);
    }
    comm_sum(energy->value, energy->n);
    comm_sum(energy->momentum, 3);
    comm_sum(energy->angular_momentum, 3);
    comm_sum(energy->mass, N_SPECIES);
    energy->total = 0;
    for (int i = 0; i < energy->n; i++) energy->total += energy->value[i];
    energy->all = 0;
    for (int k = 0; k < N_SPECIES; k++) energy->all += energy->mass[k];
    if (!energy->started) {
        energy->first = energy->total;
        energy->all_first = energy->all;
    }
    energy->started = true;
    energy->error = energy->first != 0 ? (energy->total - energy->first) / fabs(energy->first) : 0;
    energy->worst = fmax(energy->worst, fabs(energy->error));
}

struct row { const struct sim *sim; const struct energy *energy; };

static void write_header(FILE *file, const void *context)
{
    const struct sim *sim = ((const struct row *)context)->sim;
    const struct energy *energy = ((const struct row *)context)->energy;
    char t[64], e[64], p[64], l[64], m[64];
    bool physical = sim->units.physical;
    layout_unit_text(physical, "L V^-1", t, sizeof t);
    layout_unit_text(physical, "M V^2", e, sizeof e);
    layout_unit_text(physical, "M V", p, sizeof p);
    layout_unit_text(physical, "M L V", l, sizeof l);
    layout_unit_text(physical, "M", m, sizeof m);
    fprintf(file, ",dt [%s],active", t);
    for (int i = 0; i < energy->n; i++) fprintf(file, ",%s [%s]", energy->name[i], e);
    fprintf(file, ",total [%s],error", e);
    for (int k = 0; k < 3; k++) fprintf(file, ",momentum_%c [%s]", 'x' + k, p);
    for (int k = 0; k < 3; k++) fprintf(file, ",angular_momentum_%c [%s]", 'x' + k, l);
    for (int s = 0; s < N_SPECIES; s++) fprintf(file, ",mass_%s [%s]", species_names[s], m);
}

void energy_write(const struct sim *sim, const struct energy *energy, const char *name)
{
    if (comm_rank() != 0) return;
    FILE *file = series_open(sim, name, write_header, &(struct row){sim, energy});
    const struct units *units = &sim->units;
    double t = layout_factor(units, "L V^-1"), e = layout_factor(units, "M V^2"), p = layout_factor(units, "M V"),
           l = layout_factor(units, "M L V"), m = layout_factor(units, "M");
    series_time(sim, file);
    fprintf(file, ",%.6g,%lld", t * sim->last_dt, (long long)sim->ending);
    for (int i = 0; i < energy->n; i++) fprintf(file, ",%.12g", e * energy->value[i]);
    fprintf(file, ",%.12g,%.6e", e * energy->total, energy->error);
    for (int k = 0; k < 3; k++) fprintf(file, ",%.8e", p * energy->momentum[k]);
    for (int k = 0; k < 3; k++) fprintf(file, ",%.8e", l * energy->angular_momentum[k]);
    for (int s = 0; s < N_SPECIES; s++) fprintf(file, ",%.15g", m * energy->mass[s]);
    fprintf(file, "\n");
    series_close(sim, name, file);
}
