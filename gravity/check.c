/* SPDX-License-Identifier: GPL-3.0-or-later
 * The self-check, which holds a run to the accuracy asked. */
#include "comm.h"
#include "gravity.h"
#include "log.h"
#include "mem.h"
#include "random.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

/* Rows of one species in the sample with their direct sums, and what all own rows had before: NULL if
 * that is nothing, as where no module comes before gravity. */
struct part { int32_t *row; double (*exact)[4]; float (*before)[3]; int64_t n; };
struct gravity_sample { struct part part[N_SPECIES]; int64_t n; int trials; double last; };    /* last: p99 of the trial before */

enum { SAMPLE = 1024, TRIALS = 6 };
/* Parts of the accuracy asked: what the opening aims at, and what a sample may show at most. Ten rows of the sample lie
 * beyond its 99th percentile, three more or less: that of all rows may be a fourth above it. */
static const double aim = 0.6, safe = 0.8;
/* A self-check every so many longest steps, a power of two. */
enum { CHECK_EVERY = 2 };

bool gravity_check_due(const struct sim *sim, const struct gravity *g)
{
    if (g->opening.solver == SOLVER_DIRECT || sim->tree.n_nodes == 0 || !timeline_synchronous(&sim->time)) return false;
    return g->checked == 0 || (sim->time.tick > 0 && timeline_divides(sim->time.tick, RUNG_TOP + CHECK_EVERY));
}

static bool is_sampled(const struct sim *sim, const struct gravity *g, const struct species *s, int64_t i, double rows)
{
    struct random key = {sim->seed, s->id[i], (uint64_t)g->checked, random_stream("gravity_check")};
    return random_uniform(&key, 0) * rows < SAMPLE;
}

static float (*copy_before(const struct species *s))[3]
{
    const size_t bytes = (size_t)s->n_own * sizeof *s->acc;
    bool any = false;
    for (int64_t i = s->own; i < s->own + s->n_own && !any; i++)
        any = s->acc[i][0] != 0 || s->acc[i][1] != 0 || s->acc[i][2] != 0;
    return any ? memcpy(mem_alloc("gravity", bytes), s->acc + s->own, bytes) : NULL;
}

struct gravity_sample *gravity_check_begin(struct sim *sim, const struct gravity *g)
{
    struct gravity_sample *sample = mem_alloc("gravity", sizeof *sample);
    double rows = 0;
    for_species(sim, s) rows += (double)s->n;
    for_species(sim, s) {
        struct part *part = &sample->part[s->kind];
        int64_t n = 0, end = s->own + s->n_own;
        for (int64_t i = s->own; i < end; i++) n += is_sampled(sim, g, s, i, rows);
        part->row = mem_array("gravity", int32_t, n);
        for (int64_t i = s->own; i < end && part->n < n; i++)
            if (is_sampled(sim, g, s, i, rows)) part->row[part->n++] = (int32_t)i;
        part->exact = mem_alloc("gravity", (size_t)n * sizeof *part->exact);
        gravity_direct_rows(sim, g, s, part->row, n, part->exact);
        part->before = copy_before(s);
        sample->n += n;
    }
    return sample;
}

/* Error of each sampled row as `accuracy` counts it. */
static void sample_errors(const struct sim *sim, const struct gravity_sample *sample, double *error)
{
    double sums[2] = {0}, *size = mem_array("gravity", double, sample->n);
    int64_t n = 0;
    for_species(sim, s) {
        const struct part *part = &sample->part[s->kind];
        for (int64_t i = 0; i < part->n; i++, n++) {
            double d2 = 0, a2 = 0;
            for (int c = 0; c < 3; c++) {
                float before = part->before ? part->before[part->row[i] - s->own][c] : 0;
                double d = (double)(s->acc[part->row[i]][c] - before) - part->exact[i][c];
                d2 += d * d;
                a2 += part->exact[i][c] * part->exact[i][c];
            }
            error[n] = sqrt(d2);
            size[n] = sqrt(a2);
            sums[0] += a2;
            sums[1] += 1;
        }
    }
    comm_sum(sums, 2);
    const double floor = GRAVITY_FLOOR * sqrt(sums[0] / fmax(sums[1], 1));
    for (int64_t i = 0; i < n; i++) error[i] = floor > 0 ? error[i] / fmax(size[i], floor) : 0;
    mem_free(size);
}

struct gravity_errors gravity_errors_shared(double *own, int64_t n)
{
    int64_t *bytes = mem_array("gravity", int64_t, comm_size()), before = 0, total = 0;
    comm_gather_counts(n * (int64_t)sizeof *own, bytes);
    for (int r = 0; r < comm_size(); r++) {
        if (r < comm_rank()) before += bytes[r] / (int64_t)sizeof *own;
        total += bytes[r] / (int64_t)sizeof *own;
    }
    double *error = mem_array("gravity", double, total);
    if (n > 0) memcpy(error + before, own, (size_t)n * sizeof *own);
    comm_gather_all(error, bytes);
    struct gravity_errors e = gravity_errors_of(error, total);
    mem_free(error);
    mem_free(bytes);
    return e;
}

static void take_back(struct sim *sim, const struct gravity_sample *sample)
{
    for_species(sim, s) {
        const void *before = sample->part[s->kind].before;
        const size_t bytes = (size_t)s->n_own * sizeof *s->acc;
        if (before) memcpy(s->acc + s->own, before, bytes);
        else memset(s->acc + s->own, 0, bytes);
    }
}

bool gravity_check_passes(struct sim *sim, struct gravity *g, struct gravity_sample *sample)
{
    double *error = mem_array("gravity", double, sample->n);
    sample_errors(sim, sample, error);
    struct gravity_errors e = gravity_errors_shared(error, sample->n);
    mem_free(error);
    g->measured = e.p99;
    g->checked++;
    log_line("gravity: accuracy asked %.1e, measured %.1e (99 %% of %lld rows; median %.1e, largest %.1e), opening scaled by %.3f",
             g->accuracy, e.p99, (long long)e.n, e.median, e.max, g->scale);
    bool tree = g->opening.solver == SOLVER_TREE;
    /* A closer opening has not helped: forces that nearly cancel need better pairs. */
    bool rough = gravity_refinement(g) == GRAVITY_ROUGH && g->precision == PRECISION_AUTO;
    if (rough && e.p99 > safe * g->accuracy && sample->trials > 0 && e.p99 > 0.9 * sample->last) {
        log_line("gravity: pairs are refined from now on");
        g->refined = 1;
        take_back(sim, sample);
        return false;
    }
    sample->last = e.p99;
    if (!isnan(tree ? g->opening_angle : g->tolerance) || !(e.p99 > 0)) return true;
    /* The error goes as alpha, or less steeply, and as the power 2.5 of the angle; changes are bounded. */
    double change = fmin(fmax(aim * g->accuracy / e.p99, 0.25), 4);
    /* As a float: in which parts ranks have summed the reference changes its last bits. */
    g->scale = (double)(float)fmin(fmax(g->scale * (tree ? pow(change, 1 / 2.5) : change), 1e-3), 1e3);
    if (e.p99 <= safe * g->accuracy) return true;
    if (++sample->trials == TRIALS) {
        if (e.p99 > g->accuracy)
            log_warning("gravity: the accuracy asked, %g, is not reached: 1 %% of the rows err by more than %.1e", g->accuracy,
                        e.p99);
        return true;
    }
    take_back(sim, sample);
    return false;
}

void gravity_check_end(struct gravity_sample *sample)
{
    for (int k = 0; k < N_SPECIES; k++) {
        mem_free(sample->part[k].row);
        mem_free(sample->part[k].exact);
        mem_free(sample->part[k].before);
    }
    mem_free(sample);
}
