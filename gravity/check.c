/* SPDX-License-Identifier: GPL-3.0-or-later
 * `accuracy`: settings taken from the measured front, and the self-check that holds a run to it. */
#include "comm.h"
#include "gravity.h"
#include "log.h"
#include "mem.h"
#include "random.h"
#include <math.h>
#include <stdlib.h>

/* Measured on Plummer, uniform and clumped sets of 1e5 and 1e6 rows (doc/charts/gravity.csv): the
 * cheapest setting whose 99th percentile lies at or below the first column. */
struct front { double accuracy; int order; double theta, alpha; };
static const struct front tree_front[] = {
    {1e-1, 1, 1.10, 0}, {3e-2, 1, 1.00, 0}, {1e-2, 2, 0.80, 0}, {3e-3, 2, 0.60, 0},
    {1e-3, 2, 0.45, 0}, {1e-4, 2, 0.25, 0}, {0, 0, 0, 0},
};
static const struct front fmm_front[] = {
    {1e-1, 3, 0, 3e-2}, {1e-2, 3, 0, 3e-3}, {3e-3, 4, 0, 1e-3}, {1e-3, 4, 0, 4e-4}, {3e-4, 5, 0, 1e-4},
    {1e-4, 5, 0, 3e-5}, {3e-5, 6, 0, 8e-6}, {1e-5, 6, 0, 2e-6}, {1e-6, 6, 0, 1e-7}, {0, 0, 0, 0},
};

void gravity_settings(struct gravity_opening *o, double accuracy)
{
    const struct front *front = o->solver == SOLVER_FMM ? fmm_front : tree_front;
    while (front[1].accuracy > 0 && accuracy < front->accuracy) front++;
    o->order = front->order;
    o->theta = front->theta;
    /* Between the measured points the error follows the opening. */
    o->alpha = front->alpha * fmin(1, accuracy / front->accuracy);
    o->leaf_size = o->solver == SOLVER_FMM ? 64 : 32;
    o->group_size = o->solver == SOLVER_FMM ? 128 : o->solver == SOLVER_TREE ? 512 : 256;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

struct gravity_errors gravity_errors_of(double *error, int64_t n)
{
    struct gravity_errors e = {.n = n};
    if (n == 0) return e;
    qsort(error, (size_t)n, sizeof *error, compare_doubles);
    for (int64_t i = 0; i < n; i++) e.rms += error[i] * error[i];
    e.rms = sqrt(e.rms / (double)n);
    e.median = error[n / 2];
    e.p99 = error[(n * 99) / 100 < n ? (n * 99) / 100 : n - 1];
    e.max = error[n - 1];
    return e;
}

/* Rows of one species in the sample, with the acceleration they had before gravity added to it. */
struct part { int32_t *row; float (*before)[3]; int64_t n; };
struct gravity_sample { struct part part[N_SPECIES]; };

enum { SAMPLE = 1024 };
/* A self-check every so many longest steps, a power of two. */
enum { CHECK_EVERY = 5 };

bool gravity_check_due(const struct sim *sim, const struct gravity *g)
{
    if (g->opening.solver == SOLVER_DIRECT || sim->tree.n_nodes == 0 || !timeline_synchronous(&sim->time)) return false;
    return g->checked == 0 || (sim->time.tick > 0 && timeline_divides(sim->time.tick, RUNG_TOP + CHECK_EVERY));
}

struct gravity_sample *gravity_check_begin(struct sim *sim, const struct gravity *g)
{
    struct gravity_sample *sample = mem_alloc("gravity", sizeof *sample);
    double rows = 0;
    for_species(sim, s) rows += (double)s->n;
    for_species(sim, s) {
        struct part *part = &sample->part[s->kind];
        part->row = mem_array("gravity", int32_t, s->n_own);
        for (int64_t i = s->own; i < s->own + s->n_own; i++) {
            struct random key = {sim->seed, s->id[i], (uint64_t)g->checked, random_stream("gravity_check")};
            if (random_uniform(&key, 0) * rows < SAMPLE) part->row[part->n++] = (int32_t)i;
        }
        part->before = mem_alloc("gravity", (size_t)part->n * sizeof *part->before);
        for (int64_t i = 0; i < part->n; i++)
            for (int k = 0; k < 3; k++) part->before[i][k] = s->acc[part->row[i]][k];
    }
    return sample;
}

/* Error of each sampled row as `accuracy` counts it. */
static int64_t sample_errors(const struct sim *sim, const struct gravity *g, const struct gravity_sample *sample,
                             double *error)
{
    int64_t n = 0;
    double square = 0, count = 0, *size = error + 4 * SAMPLE;
    for (int k = 0; k < N_SPECIES; k++) {
        const struct part *part = &sample->part[k];
        const struct species *s = &sim->species[k];
        double (*exact)[4] = mem_alloc("gravity", (size_t)part->n * sizeof *exact);
        gravity_direct_rows(sim, g, s, part->row, part->n, exact);
        for (int64_t i = 0; i < part->n && n < 4 * SAMPLE; i++, n++) {
            double d2 = 0, a2 = 0;
            for (int c = 0; c < 3; c++) {
                double d = (double)(s->acc[part->row[i]][c] - part->before[i][c]) - exact[i][c];
                d2 += d * d;
                a2 += exact[i][c] * exact[i][c];
            }
            error[n] = sqrt(d2);
            size[n] = sqrt(a2);
            square += a2;
            count += 1;
        }
        mem_free(exact);
    }
    comm_sum(&square, 1);
    comm_sum(&count, 1);
    const double floor = 1e-2 * sqrt(square / fmax(count, 1));
    for (int64_t i = 0; i < n; i++) error[i] = floor > 0 ? error[i] / fmax(size[i], floor) : 0;
    return n;
}

/* All ranks' errors on every rank, in rank order. */
static int64_t share_errors(double *error, int64_t n)
{
    int64_t *bytes = mem_array("gravity", int64_t, comm_size()), before = 0, total = 0;
    comm_gather_counts(n * (int64_t)sizeof *error, bytes);
    for (int r = 0; r < comm_size(); r++) {
        if (r < comm_rank()) before += bytes[r] / (int64_t)sizeof *error;
        total += bytes[r] / (int64_t)sizeof *error;
    }
    for (int64_t i = n - 1; i >= 0; i--) error[before + i] = error[i];
    comm_gather_all(error, bytes);
    mem_free(bytes);
    return total;
}

void gravity_check_end(struct sim *sim, struct gravity *g, struct gravity_sample *sample)
{
    static const double aim = 0.6;  /* of the accuracy asked */
    double *error = mem_array("gravity", double, 8 * SAMPLE);
    int64_t n = share_errors(error, sample_errors(sim, g, sample, error));
    struct gravity_errors e = gravity_errors_of(error, n);
    g->measured = e.p99;
    g->checked++;
    log_line("gravity: accuracy asked %.1e, measured %.1e (99 %% of %lld rows; median %.1e, largest %.1e), opening scaled by %.3f",
             g->accuracy, e.p99, (long long)n, e.median, e.max, g->scale);
    bool own_choice = g->opening.solver == SOLVER_TREE ? isnan(g->opening_angle) : true;
    if (own_choice && e.p99 > 0) {
        /* The error goes as alpha, and as the power 2.5 of the angle; changes are bounded. */
        double change = aim * g->accuracy / e.p99;
        change = fmin(fmax(change, 0.25), 4);
        if (g->opening.solver == SOLVER_TREE) change = pow(change, 1 / 2.5);
        g->scale = fmin(fmax(g->scale * change, 1e-3), 1e3);
    }
    for (int k = 0; k < N_SPECIES; k++) {
        mem_free(sample->part[k].row);
        mem_free(sample->part[k].before);
    }
    mem_free(sample);
    mem_free(error);
}
