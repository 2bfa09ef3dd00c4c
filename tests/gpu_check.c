/* SPDX-License-Identifier: GPL-3.0-or-later
 * Compares the kernels with double sums on the CPU and times them; one CSV row each, printed at once,
 * so that a run that is cut still reports. Columns: doc/gpu-results.md. `gpu_check --time` adds the
 * timings; without, it runs on the host shim too, as a test of itself. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "commit.h"
#include "comm.h"
#include "device.h"
#include "gravity/direct_engine.h"
#include "gpu_hermite.h"
#include "gpu_scenes.h"
#include "gravity/pair.h"
#include "mem.h"
#include "random.h"

enum { COMPARED = 256 };        /* rows whose reference is summed on the CPU */

static const char *const form_names[] = {"plummer-common", "plummer", "spline"};
static const char *const precision_names[] = {"float", "pair"};

struct rows { int n; double (*pos)[3], *mass; float *soft; int32_t *own; };

/* A Plummer sphere of unit mass and scale (Aarseth, Henon & Wielen 1974), softened by 0.01. */
static struct rows rows_make(int n)
{
    struct rows r = {n, mem_alloc("rows", sizeof *r.pos * (size_t)n), mem_array("rows", double, n),
                     mem_array("rows", float, n), mem_array("rows", int32_t, n)};
    for (int i = 0; i < n; i++) {
        struct random key = {.seed = 1, .id = (uint64_t)i};
        double unit[3], radius = 1 / sqrt(pow(random_uniform(&key, 4), -2.0 / 3.0) - 1);
        random_direction(&key, 0, unit);
        for (int k = 0; k < 3; k++) r.pos[i][k] = radius * unit[k];
        r.mass[i] = 1.0 / n;
        r.soft[i] = 0.5e-4f;
        r.own[i] = i;
    }
    return r;
}

static void rows_free(struct rows *r)
{
    mem_free(r->pos);
    mem_free(r->mass);
    mem_free(r->soft);
    mem_free(r->own);
}

static void reference(const struct rows *r, enum softening_form form, int i, double acc[4])
{
    memset(acc, 0, 4 * sizeof *acc);
    for (int j = 0; j < r->n; j++) {
        double d[3], r2 = 0;
        for (int k = 0; k < 3; k++) r2 += pow(d[k] = r->pos[j][k] - r->pos[i][k], 2);
        if (j == i) continue;
        struct pair p = pair_any(form, r2, r->mass[j], (double)r->soft[i] + (double)r->soft[j]);
        for (int k = 0; k < 3; k++) acc[k] += (double)PAIR_PULL * p.pull * d[k];
        acc[3] -= (double)PAIR_DEPTH * p.depth;
    }
}

/* Relative errors, root mean square over COMPARED targets spread over the first n. */
static void compare(const struct rows *r, enum softening_form form, int n, double (*acc)[3], const double *pot,
                    double rms[2])
{
    int count = n < COMPARED ? n : COMPARED;
    rms[0] = rms[1] = 0;
    for (int c = 0; c < count; c++) {
        int i = (int)((int64_t)c * n / count);
        double a[4], e2 = 0, a2 = 0;
        reference(r, form, i, a);
        for (int k = 0; k < 3; k++) {
            e2 += pow(acc[i][k] - a[k], 2);
            a2 += a[k] * a[k];
        }
        rms[0] += e2 / a2 / count;
        rms[1] += pow(pot[i] / a[3] - 1, 2) / count;
    }
    rms[0] = sqrt(rms[0]);
    rms[1] = sqrt(rms[1]);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* One row of the table: the first `targets` of n rows feel all n. Returns whether the error is within bounds. */
static int measure(struct device *device, enum softening_form form, enum direct_precision precision, int n, int targets)
{
    const double bound[] = {[DIRECT_FLOAT] = 1e-5, [DIRECT_PAIR] = 1e-7};
    struct rows r = rows_make(n);
    double (*acc)[3] = mem_alloc("rows", sizeof *acc * (size_t)targets), *pot = mem_array("rows", double, targets);
    struct direct_rows sources = {n, r.pos, r.mass, r.soft, NULL}, wanted = {targets, r.pos, r.mass, r.soft, r.own};
    struct direct_engine *engine = direct_engine_create(device, (int)form, precision, 0);
    direct_engine_sources(engine, &sources);
    direct_engine_sum(engine, &wanted, acc, pot);     /* the first call allocates and wakes the device */
    double began = seconds(), rms[2];
    direct_engine_sum(engine, &wanted, acc, pot);
    double took = seconds() - began;
    const char *error = device_error(device);
    if (!error) compare(&r, form, targets, acc, pot, rms);
    int fine = !error && rms[0] < bound[precision] && rms[1] < bound[precision];
    if (error) printf("direct,%s,%s,%d,%d,,,,,FAILED: %s\n", form_names[form], precision_names[precision], n, targets, error);
    else printf("direct,%s,%s,%d,%d,%.4g,%.4g,%.2e,%.2e,%s\n", form_names[form], precision_names[precision], n, targets,
                took, (double)n * targets / took, rms[0], rms[1], fine ? "ok" : "FAILED: error out of bounds");
    fflush(stdout);
    direct_engine_free(engine);
    mem_free(acc);
    mem_free(pot);
    rows_free(&r);
    return fine;
}

int main(int argc, char **argv)
{
    static const struct { int n, targets; } timed[] = {{100000, 100000}, {1000000, 1000000}, {10000000, 100000}};
    int time_it = argc > 1 && strcmp(argv[1], "--time") == 0, failed = 0;
    comm_begin(&argc, &argv);
    struct device *device = device_open(DEVICE_CUDA);
    size_t free, total;
    device_memory(device, &free, &total);
    printf("# device %s, %.1f GB, commit %s\n", device_name(device), (double)total * 1e-9, TEPHRA_COMMIT);
    printf("kernel,form,precision,n,targets,seconds,pairs_per_second,rms_acceleration,rms_potential,verdict\n");
    for (enum softening_form form = SOFT_COMMON; form <= SOFT_SPLINE; form++)
        for (enum direct_precision precision = DIRECT_FLOAT; precision <= DIRECT_PAIR; precision++)
            failed += !measure(device, form, precision, 5000, 1000);
    failed += gpu_hermite(device, false);
    failed += gpu_scenes(device, false);
    for (size_t t = 0; t < sizeof timed / sizeof *timed && time_it; t++)
        for (enum direct_precision precision = DIRECT_FLOAT; precision <= DIRECT_PAIR; precision++)
            failed += !measure(device, SOFT_COMMON, precision, timed[t].n, timed[t].targets);
    if (time_it) failed += gpu_hermite(device, true) + gpu_scenes(device, true);
    device_close(device);
    comm_end();
    return failed > 0;
}
