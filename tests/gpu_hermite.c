/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sums of Hermite's schemes on a device against the CPU's in double, and their rates against what the device could issue. */
#include "gpu_hermite.h"
#include "device.h"
#include "gravity/gravity.h"
#include "gravity/hermite_engine.h"
#include "gravity/hermite_predict.h"
#include "mem.h"
#include "profile.h"
#include "random.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COMPARED = 128, NOW = 64 };
static const double tick_length = 1.0 / 4096;

/* A Plummer sphere of unit mass and scale (Aarseth, Henon & Wielen 1974), softened by 1e-4; derivatives of its size, states of
 * up to 64 ticks ago. Numbers as hermite_engine.h has them. */
struct states { int n, p, width; double *number; int64_t *began; int32_t *place; };

static struct states states_make(int n, int p)
{
    const int width = 3 * (2 + hermite_kept(p)) + 2;
    struct states s = {n, p, width, mem_array("rows", double, (int64_t)width * n), mem_array("rows", int64_t, n),
                       mem_array("rows", int32_t, n)};
    for (int64_t i = 0; i < n; i++) {
        struct random key = {.seed = 1, .id = (uint64_t)i};
        double unit[3], radius = 1 / sqrt(pow(random_uniform(&key, 4), -2.0 / 3.0) - 1);
        random_direction(&key, 0, unit);
        for (int k = 0; k < 3; k++) s.number[k * (int64_t)n + i] = radius * unit[k];
        for (int c = 3; c < width - 2; c++) s.number[c * (int64_t)n + i] = random_uniform(&key, (unsigned)(8 + c)) - 0.5;
        s.number[(width - 2) * (int64_t)n + i] = 1.0 / n;
        s.number[(width - 1) * (int64_t)n + i] = 0.5e-8;
        s.began[i] = NOW - i % NOW;
        s.place[i] = (int32_t)i;
    }
    return s;
}

static void states_free(struct states *s)
{
    mem_free(s->number);
    mem_free(s->began);
    mem_free(s->place);
}

/* Root mean square over some of the first `targets` rows of the difference to the CPU's sums, by derivative, relative to their
 * rms size. */
static void compare(const struct states *s, int targets, const double *sum, double rms[3])
{
    const struct gravity_kernels *kernels = gravity_kernels_find(isa_now());
    const int terms = 2 + hermite_kept(s->p), count = targets < COMPARED ? targets : COMPARED;
    const int64_t room = (s->n + GRAVITY_LANES_MAX - 1) / GRAVITY_LANES_MAX * GRAVITY_LANES_MAX;
    double *column = mem_array("rows", double, 14 * room), square[3] = {0};
    struct hermite_rows rows = {.n = s->n, .mass = column + 12 * room, .soft = column + 13 * room};
    for (int k = 0; k < 3; k++) {
        double **const part[4] = {&rows.pos[k], &rows.vel[k], &rows.acc[k], &rows.jerk[k]};
        for (int d = 0; d < 4; d++) *part[d] = column + (3 * d + k) * room;
    }
    for (int64_t i = 0; i < room; i++) rows.soft[i] = 1;
    for (int64_t i = 0; i < s->n; i++) {
        for (int w = 0; w < 12; w++) {
            double d[6];
            for (int c = w / 3; c < terms; c++) d[c] = s->number[(3 * c + w % 3) * (int64_t)s->n + i];
            column[w * room + i] = hermite_taylor(d + w / 3, terms - w / 3, (double)(NOW - s->began[i]) * tick_length);
        }
        rows.mass[i] = s->number[(s->width - 2) * (int64_t)s->n + i];
        rows.soft[i] = s->number[(s->width - 1) * (int64_t)s->n + i];
    }
    memset(rms, 0, 3 * sizeof *rms);
    for (int c = 0; c < count; c++) {
        const int64_t i = (int64_t)c * targets / count;
        double target[13], exact[12];
        for (int w = 0; w < 12; w++) target[w] = column[w * room + i];
        target[12] = rows.soft[i];
        kernels->hermite->sum[0][s->p - 2](exact, target, &rows, 0, s->n);
        for (int w = 0; w < 3 * s->p; w++) {
            rms[w / 3] += pow(sum[i * 3 * s->p + w] - exact[w], 2);
            square[w / 3] += exact[w] * exact[w];
        }
    }
    for (int d = 0; d < s->p; d++) rms[d] = sqrt(rms[d] / square[d]);
    mem_free(column);
}

/* The first `targets` of n rows; the better of two sums. Returns whether the errors are within bounds. */
static int measure(struct device *device, int p, int n, int targets)
{
    /* Pairs a second that 132 multiprocessors of 128 lanes at 1.98 GHz can issue: doc/gpu-results.md. */
    static const double limit[] = {[2] = 9.5e11, [3] = 5.7e11}, bound[3] = {2e-7, 1e-6, 1e-5};
    const struct hermite_now now = {NOW, tick_length};
    struct states s = states_make(n, p);
    double *sum = mem_array("rows", double, (int64_t)3 * p * targets), least = INFINITY, rms[3] = {0};
    struct hermite_engine *engine = hermite_engine_create(device, p, false, 0);
    hermite_engine_rows(engine, n, &(struct hermite_units){0x1p-10, 1, {0}});
    hermite_engine_put(engine, &(struct hermite_states){n, s.place, s.number, s.began});
    for (int k = 0; k < 2; k++) {
        const double began = profile_wall();
        hermite_engine_sum(engine, &now, p, s.place, targets, sum);
        least = fmin(least, profile_wall() - began);
    }
    const char *error = device_error(device);
    if (!error) compare(&s, targets, sum, rms);
    int fine = !error;
    for (int d = 0; d < p; d++) fine &= rms[d] < bound[d];
    printf("hermite%d,%d,%d,%.4g,%.4g,%.3f,%.2e,%.2e,%.2e,%s%s\n", 2 * p, n, targets, least, (double)n * targets / least,
           (double)n * targets / least / limit[p], rms[0], rms[1], rms[2], fine ? "ok" : "FAILED: ",
           fine ? "" : error ? error : "errors out of bounds");
    fflush(stdout);
    hermite_engine_free(engine);
    mem_free(sum);
    states_free(&s);
    return fine;
}

int gpu_hermite(struct device *device, bool time_it)
{
    static const int timed[][2] = {{1000000, 100}, {1000000, 10000}, {1000000, 1000000}, {65536, 1000}, {65536, 65536}};
    int failed = 0;
    printf("kernel,n,targets,seconds,pairs_per_second,part_of_limit,rms_acceleration,rms_jerk,rms_snap,verdict\n");
    for (int p = 2; p <= 3; p++) {
        if (!time_it) failed += !measure(device, p, 2000, 300);
        for (size_t t = 0; t < sizeof timed / sizeof *timed && time_it; t++) failed += !measure(device, p, timed[t][0], timed[t][1]);
    }
    return failed;
}
