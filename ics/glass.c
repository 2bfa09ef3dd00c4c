/* SPDX-License-Identifier: GPL-3.0-or-later
 * A glass (lattice.h): points of even density without an order that reaches far. Random points of a periodic box push
 * each other apart, less and less, until they rest (after Diehl et al. 2015, PASA 32, 48, for one even density);
 * copies of the box fill the ball. */
#include "lattice.h"
#include "mem.h"
#include "random.h"
#include <math.h>
#include <string.h>

/* Points along a side of the box, and sweeps, after which the nearest neighbours have come to rest. */
enum { SIDE = 16, POINTS = SIDE * SIDE * SIDE, SWEEPS = 120 };
/* In mean spacings: how far a push reaches, the longest move of a sweep; of the sum of pushes, at the start. */
static const double reach = 2.3, longest = 0.2, push = 0.25;

/* The box is divided into cells no smaller than a push reaches; the points of a cell are a chain. */
enum { CELLS = 6 };
struct cells { int32_t first[CELLS][CELLS][CELLS], next[POINTS]; };

static int cell_of(double x) { return (int)(x * CELLS / SIDE) % CELLS; }
static double wrapped(double x) { return x - SIDE * floor(x / SIDE); }

static void sort_into_cells(double (*pos)[3], struct cells *cells)
{
    memset(cells->first, 0xff, sizeof cells->first);
    for (int32_t i = POINTS - 1; i >= 0; i--) {
        int32_t *first = &cells->first[cell_of(pos[i][0])][cell_of(pos[i][1])][cell_of(pos[i][2])];
        cells->next[i] = *first;
        *first = i;
    }
}

/* Adds what the points of one chain push a point by: (1 - r/reach)^2 along the line from them. */
static void pushed(double (*pos)[3], const struct cells *cells, int32_t j, int32_t i, double sum[3])
{
    for (; j >= 0; j = cells->next[j]) {
        double d[3], r2 = 0;
        for (int k = 0; k < 3; k++) {
            d[k] = pos[i][k] - pos[j][k];
            d[k] -= SIDE * rint(d[k] / SIDE);
            r2 += d[k] * d[k];
        }
        if (j == i || !(r2 < reach * reach && r2 > 0)) continue;
        double r = sqrt(r2), q = 1 - r / reach;
        for (int k = 0; k < 3; k++) sum[k] += q * q / r * d[k];
    }
}

static void move(double (*pos)[3], const struct cells *cells, int32_t i, double factor, double moved[3])
{
    double sum[3] = {0};
    const int at[3] = {cell_of(pos[i][0]), cell_of(pos[i][1]), cell_of(pos[i][2])};
    for (int c = 0; c < 27; c++) {
        const int of[3] = {c % 3, c / 3 % 3, c / 9};
        int cell[3];
        for (int k = 0; k < 3; k++) cell[k] = (at[k] + of[k] + CELLS - 1) % CELLS;
        pushed(pos, cells, cells->first[cell[0]][cell[1]][cell[2]], i, sum);
    }
    double size = factor * sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    double scale = factor * (size > longest ? longest / size : 1);
    for (int k = 0; k < 3; k++) moved[k] = wrapped(pos[i][k] + scale * sum[k]);
}

double (*glass_box(int *side))[3]
{
    double (*pos)[3] = mem_alloc("generator", POINTS * sizeof *pos), (*moved)[3] = mem_alloc("generator", POINTS * sizeof *pos);
    struct cells *cells = mem_alloc("generator", sizeof *cells);
    const uint64_t stream = random_stream("glass");
    for (int i = 0; i < POINTS; i++) {
        const struct random key = {1, (uint64_t)i + 1, 0, stream};
        for (int k = 0; k < 3; k++) pos[i][k] = SIDE * random_uniform(&key, (uint64_t)k);
    }
    for (int s = 0; s < SWEEPS; s++) {
        const double factor = push * (1 - 0.9 * s / SWEEPS);
        sort_into_cells(pos, cells);
#pragma omp parallel for
        for (int32_t i = 0; i < POINTS; i++) move(pos, cells, i, factor, moved[i]);
        memcpy(pos, moved, POINTS * sizeof *pos);
    }
    mem_free(moved);
    mem_free(cells);
    *side = SIDE;
    return pos;
}
