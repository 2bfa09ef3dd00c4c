/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rates of the pair and cell kernels of every instruction set on one core. Usage: bench_gravity. */
#include "gravity/kernels.h"
#include "gravity/pair.h"
#include "isa.h"
#include "profile.h"
#include <math.h>
#include <stdio.h>

enum { TARGETS = 128, SOURCES = 1024, TIMES = 1000, TRIALS = 5, CELLS = 512, WIDTH = 64 };

static float column[4][TARGETS];
static double sum[4][TARGETS];
static int32_t own[TARGETS], list[CELLS];
static struct gravity_source row[SOURCES];
static float soft[SOURCES], moment[CELLS * WIDTH];
static struct gravity_cell cell[CELLS];
static struct gravity_targets targets = {.n = TARGETS, .capacity = TARGETS, .x = column[0], .y = column[1], .z = column[2],
    .unit = 1, .soft = column[3], .own = own, .ax = sum[0], .ay = sum[1], .az = sum[2], .depth = sum[3]};
static struct gravity_sources sources = {.n = SOURCES, .capacity = SOURCES, .row = row, .soft = soft, .soft2 = 1e-4f};
static struct gravity_far far_cells = {.cell = cell, .moment = moment, .width = WIDTH, .list = list, .n = CELLS,
    .scale = 1, .soft2 = 1e-4f};

/* A fraction that looks random. */
static float fraction(unsigned i) { return (float)(i * 2654435761u >> 8) / (float)(1 << 24); }

static void fill(void)
{
    for (unsigned i = 0; i < TARGETS; i++) {
        for (unsigned k = 0; k < 3; k++) column[k][i] = fraction(5 * i + k);
        column[3][i] = 5e-5f;
        own[i] = (int32_t)i;
    }
    for (unsigned j = 0; j < SOURCES; j++) {
        row[j] = (struct gravity_source){fraction(7 * j), fraction(7 * j + 1), fraction(7 * j + 2), 1e-3f};
        soft[j] = 5e-5f;
    }
    for (unsigned c = 0; c < CELLS; c++) {
        list[c] = (int32_t)c;
        cell[c] = (struct gravity_cell){.pos = {3 + (double)fraction(c), 2, 1}, .reach = 0.5f, .scale = 0.5f, .mass = 1};
        for (unsigned k = 0; k < WIDTH; k++) moment[c * WIDTH + k] = 1e-3f * fraction(c + k);
    }
}

static double pair_rate(gravity_pair_sum *kernel)
{
    double least = INFINITY;
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < TIMES; i++) kernel(&targets, &sources);
        least = fmin(least, profile_cpu() - cpu);
    }
    return (double)TARGETS * SOURCES * TIMES / least;
}

static double cell_rate(gravity_cell_sum *kernel)
{
    double least = INFINITY;
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < TIMES; i++) kernel(&targets, &far_cells);
        least = fmin(least, profile_cpu() - cpu);
    }
    return (double)TARGETS * CELLS * TIMES / least;
}

static double local_time(gravity_local_sum *kernel)
{
    double least = INFINITY;
    float local[128] = {0};
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < TIMES; i++) kernel(local, &far_cells);
        least = fmin(least, profile_cpu() - cpu);
    }
    return least / ((double)CELLS * TIMES);
}

/* Pairs in double, the reference's: the yardstick of doc/benchmarks.md. */
static double exact_rate(gravity_exact_sum *kernel)
{
    static struct gravity_exact rows = {.n = GRAVITY_EXACT};
    double least = INFINITY, out[4] = {0};
    const double target[4] = {0.5, 0.5, 0.5, 5e-5};
    for (unsigned j = 0; j < GRAVITY_EXACT; j++) {
        rows.x[j] = (double)fraction(3 * j), rows.y[j] = (double)fraction(3 * j + 1), rows.z[j] = (double)fraction(3 * j + 2);
        rows.mass[j] = rows.soft[j] = 5e-5;
    }
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < 100 * TIMES; i++) kernel(out, target, &rows);
        least = fmin(least, profile_cpu() - cpu);
    }
    return (double)GRAVITY_EXACT * 100 * TIMES / least;
}

/* Pairs a second of Hermite's sums in doubles and in floats: one target and as many sources as a chunk has. */
enum { LINE = 512 };

static double hermite_rate(hermite_sum *kernel, const double *target)
{
    static double field[14][LINE];
    const struct hermite_rows rows = {.n = LINE, .pos = {field[0], field[1], field[2]}, .vel = {field[3], field[4], field[5]},
        .acc = {field[6], field[7], field[8]}, .jerk = {field[9], field[10], field[11]}, .mass = field[12], .soft = field[13]};
    double least = INFINITY, out[12];
    for (unsigned c = 0; c < 14; c++)
        for (unsigned j = 0; j < LINE; j++) field[c][j] = (double)fraction(LINE * c + j);
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < 10 * TIMES; i++) kernel(out, target, &rows, 0, LINE);
        least = fmin(least, profile_cpu() - cpu);
    }
    return (double)LINE * 10 * TIMES / least;
}

static double hermite_float_rate(hermite_float_sum *kernel, const double *target)
{
    static float field[14][LINE];
    struct hermite_floats rows = {.mass = field[12], .soft = field[13]};
    float **const part[] = {rows.high, rows.low, rows.vel, rows.acc};
    double least = INFINITY, out[12];
    for (unsigned c = 0; c < 14; c++) {
        if (c < 12) part[c / 3][c % 3] = field[c];
        for (unsigned j = 0; j < LINE; j++) field[c][j] = fraction(LINE * c + j);
    }
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < 10 * TIMES; i++) kernel(out, target, &rows, 0, LINE);
        least = fmin(least, profile_cpu() - cpu);
    }
    return (double)LINE * 10 * TIMES / least;
}

/* Pairs a second that the instructions of Hermite's loop of order 4 in doubles allow, without loads and without waiting for each
 * other: 25 products, 8 sums and a root of 8 lanes for 8 pairs. And products alone, a second. */
#define PRODUCT(to) "vfmadd231pd %%zmm30, %%zmm31, %%zmm" #to "\n\t"
#define SUM(to) "vaddpd %%zmm30, %%zmm" #to ", %%zmm" #to "\n\t"
#define FOUR(a, b, c, d) PRODUCT(a) PRODUCT(b) PRODUCT(c) SUM(d)
#define CLOBBERS(n) "xmm" #n
#define ZMM(n) CLOBBERS(n##0), CLOBBERS(n##1), CLOBBERS(n##2), CLOBBERS(n##3), CLOBBERS(n##4), CLOBBERS(n##5), CLOBBERS(n##6), \
    CLOBBERS(n##7), CLOBBERS(n##8), CLOBBERS(n##9)
__attribute__((target("avx512f"))) static void issue(double *pairs, double *products)
{
    *pairs = *products = 0;
    for (int t = 0; t < TRIALS; t++) {
        double cpu = profile_cpu();
        for (int i = 0; i < 300 * TIMES; i++)
            __asm__ volatile(FOUR(0, 1, 2, 16) FOUR(3, 4, 5, 17) FOUR(6, 7, 8, 18) FOUR(9, 10, 11, 19) FOUR(12, 13, 14, 20)
                             FOUR(15, 0, 1, 21) FOUR(2, 3, 4, 22) FOUR(5, 6, 7, 23) PRODUCT(8)
                             "vrsqrt14pd %%zmm31, %%zmm24" ::: ZMM(), ZMM(1), ZMM(2), "xmm30", "xmm31");
        *pairs = fmax(*pairs, 8 * 300.0 * TIMES / (profile_cpu() - cpu));
        cpu = profile_cpu();
        for (int i = 0; i < 300 * TIMES; i++)
            __asm__ volatile(PRODUCT(0) PRODUCT(1) PRODUCT(2) PRODUCT(3) PRODUCT(4) PRODUCT(5) PRODUCT(6) PRODUCT(7) PRODUCT(8)
                             PRODUCT(9) PRODUCT(10) PRODUCT(11) PRODUCT(12) PRODUCT(13) PRODUCT(14) PRODUCT(15)
                             ::: ZMM(), ZMM(1), ZMM(2), "xmm30", "xmm31");
        *products = fmax(*products, 16 * 300.0 * TIMES / (profile_cpu() - cpu));
    }
}

int main(void)
{
    static const char *const forms[] = {"one Plummer softening", "Plummer softenings", "spline"};
    fill();
    for (int isa = 0; isa < N_ISA; isa++) {
        if (!isa_runs((enum isa)isa)) continue;
        const struct gravity_kernels *k = gravity_kernels_find((enum isa)isa);
        for (int form = 0; form < GRAVITY_FORMS; form++)
            printf("%s %-22s 1e9 pairs/s: acceleration %.2f rough %.2f, with potential %.2f rough %.2f\n", isa_names[isa],
                   forms[form], 1e-9 * pair_rate(k->pair->acc[GRAVITY_REFINED][form]), 1e-9 * pair_rate(k->pair->acc[GRAVITY_ROUGH][form]),
                   1e-9 * pair_rate(k->pair->pot[GRAVITY_REFINED][form]), 1e-9 * pair_rate(k->pair->pot[GRAVITY_ROUGH][form]));
        printf("%s 1e9 pairs in double: %.2f CPU s\n", isa_names[isa], 1e9 / exact_rate(k->exact->sum[SOFT_COMMON]));
        const double target[13] = {0.5, 0.5, 0.5, [12] = 5e-5};
        printf("%s Hermite's sums of order 4, 6, 8, 1e9 pairs/s:", isa_names[isa]);
        for (int d = 0; d < 3; d++)
            printf(" %.2f", 1e-9 * hermite_rate(k->hermite->sum[0][d], target));
        printf("; of order 4, 6 in floats: %.2f %.2f", 1e-9 * hermite_float_rate(k->hermite_float->sum[0][0], target),
               1e-9 * hermite_float_rate(k->hermite_float->sum[0][1], target));
        if (isa == ISA_V4) {
            double pairs, products;
            issue(&pairs, &products);
            printf("; at most %.2f of order 4 with %.2f 1e9 products of 8 a second", 1e-9 * pairs, 1e-9 * products);
        }
        printf("\n%s quadrupole cells on rows: %.2f 1e9/s; cells to local expansions of order 3 to 6, ns:", isa_names[isa],
               1e-9 * cell_rate(k->far->quadrupoles[0]));
        for (int o = 0; o < GRAVITY_ORDERS; o++) printf(" %.1f", 1e9 * local_time(k->far->to_local[o]));
        printf("\n");
    }
    return 0;
}
