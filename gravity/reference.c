/* SPDX-License-Identifier: GPL-3.0-or-later
 * Forces on their own, for tests and charts: one force with its cost, and its errors against direct sums in
 * double on a sample of rows (gravity.h). */
#include "comm.h"
#include "gravity.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "random.h"
#include "ranks.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int64_t gravity_count_rows(const struct sim *sim)
{
    int64_t rows = 0;
    for_species(sim, s) rows += s->n;
    return rows;
}

struct gravity_cost gravity_force(struct sim *sim)
{
    double cpu[3] = {profile_cpu()};
    for_species(sim, s) memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    sim_find_active(sim);
    sim->rebuild_next = true;
    sim_run_hook(sim, HOOK_ARRANGE);
    cpu[1] = profile_cpu();
    sim_run_hook(sim, HOOK_FORCE);
    cpu[2] = profile_cpu();
    if (ranks_failed(sim)) fail(STATUS_NUMBERS, "%s", sim->failure.text);
    comm_sum(cpu, 3);
    return (struct gravity_cost){cpu[1] - cpu[0], cpu[2] - cpu[1]};
}

static double row_draw(const struct sim *sim, const struct species *s, int64_t i)
{
    struct random key = {sim->seed, s->id[i], 0, random_stream("force_test")};
    return random_uniform(&key, 0);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rows whose draw is below this are `sample` of them. */
static double draw_limit(const struct sim *sim, int64_t sample)
{
    int64_t n = 0, rows = gravity_count_rows(sim);
    if (sample >= rows) return 1;
    double *draw = mem_array("gravity", double, rows);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) draw[n++] = row_draw(sim, s, i);
    qsort(draw, (size_t)n, sizeof *draw, compare_doubles);
    double limit = draw[sample];
    mem_free(draw);
    return limit;
}

/* Relative error of one acceleration; that of a row without any counts absolutely. */
double gravity_relative_error(const float acc[3], const double exact[4])
{
    double d2 = 0, a2 = 0;
    for (int k = 0; k < 3; k++) {
        d2 += ((double)acc[k] - exact[k]) * ((double)acc[k] - exact[k]);
        a2 += exact[k] * exact[k];
    }
    return sqrt(a2 > 0 ? d2 / a2 : d2);
}

struct gravity_reference gravity_reference_make(const struct sim *sim, const struct gravity *g, int64_t sample)
{
    struct gravity_reference r = {0};
    double limit = draw_limit(sim, sample);
    for_species(sim, s) {
        int k = (int)s->kind;
        r.row[k] = mem_array("gravity", int32_t, s->n_own);
        for (int64_t i = s->own; i < s->own + s->n_own; i++)
            if (row_draw(sim, s, i) < limit) r.row[k][r.n[k]++] = (int32_t)i;
        r.exact[k] = mem_alloc("gravity", (size_t)r.n[k] * sizeof *r.exact[k]);
        gravity_direct_rows(sim, g, s, r.row[k], r.n[k], r.exact[k]);
    }
    return r;
}

struct gravity_errors gravity_reference_compare(const struct sim *sim, const struct gravity_reference *r)
{
    int64_t n = 0, i = 0;
    for (int k = 0; k < N_SPECIES; k++) n += r->n[k];
    double *error = mem_array("gravity", double, n);
    for_species(sim, s)
        for (int64_t j = 0; j < r->n[s->kind]; j++)
            error[i++] = gravity_relative_error(s->acc[r->row[s->kind][j]], r->exact[s->kind][j]);
    struct gravity_errors e = gravity_errors_shared(error, n);
    mem_free(error);
    return e;
}

double gravity_reference_held(const struct sim *sim, const struct gravity_reference *r)
{
    int64_t n = 0;
    double sums[2] = {0};
    for (int k = 0; k < N_SPECIES; k++)
        for (int64_t j = 0; j < r->n[k]; j++, n++)
            for (int d = 0; d < 3; d++) sums[0] += r->exact[k][j][d] * r->exact[k][j][d];
    sums[1] = (double)n;
    comm_sum(sums, 2);
    const double floor2 = GRAVITY_FLOOR * GRAVITY_FLOOR * sums[0] / fmax(sums[1], 1);
    double *error = mem_array("gravity", double, n);
    n = 0;
    for_species(sim, s)
        for (int64_t j = 0; j < r->n[s->kind]; j++) {
            const float *acc = s->acc[r->row[s->kind][j]];
            const double *exact = r->exact[s->kind][j], a2 = exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2];
            const double relative = gravity_relative_error(acc, exact);
            error[n++] = a2 < floor2 && a2 > 0 ? relative * sqrt(a2 / floor2) : relative;
        }
    struct gravity_errors e = gravity_errors_shared(error, n);
    mem_free(error);
    return e.p99;
}

void gravity_reference_free(struct gravity_reference *r)
{
    for (int k = 0; k < N_SPECIES; k++) {
        mem_free(r->row[k]);
        mem_free(r->exact[k]);
    }
}

