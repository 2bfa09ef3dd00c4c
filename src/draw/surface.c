/* SPDX-License-Identifier: GPL-3.0-or-later
 * Surface density by a pyramid (surface.h): a wide kernel goes to a coarse level, so that every row
 * costs some hundred pixels at most, and the levels are added up by bilinear interpolation. The
 * kernel is the cubic spline (Monaghan & Lattanzio 1985), integrated along the line of sight. */
#include "surface.h"
#include "comm.h"
#include "mem.h"
#include <math.h>
#include <omp.h>

enum { LEVELS = 7, TABLE = 1024, STEPS = 64 };
static const double widest = 8, narrowest = 2;  /* radius of the support on its level, in pixels */

struct surface {
    float (*level[LEVELS])[2];
    float column[TABLE + 1];    /* by q^2 = r^2/h^2 from 0 to 4 */
};

static double cubic_spline(double q)
{
    if (q >= 2) return 0;
    return q < 1 ? (1 - 1.5 * q * q + 0.75 * q * q * q) / M_PI : 0.25 * pow(2 - q, 3) / M_PI;
}

/* The line of sight through the support, by Simpson's rule. */
static double kernel_column(double q2)
{
    double half = sqrt(fmax(4 - q2, 0)), sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double z = half * i / STEPS, weight = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
        sum += weight * cubic_spline(sqrt(q2 + z * z));
    }
    return 2 * sum * half / (3 * STEPS);
}

struct surface *surface_new(void)
{
    struct surface *surface = mem_alloc("pictures", sizeof *surface);
    for (int l = 0, size = SURFACE_SIZE; l < LEVELS; l++, size /= 2)
        surface->level[l] = mem_alloc("pictures", (size_t)(size * size) * sizeof(float[2]));
    for (int i = 0; i <= TABLE; i++) surface->column[i] = (float)kernel_column(4.0 * i / TABLE);
    return surface;
}

void surface_free(struct surface *surface)
{
    for (int l = 0; l < LEVELS; l++) mem_free(surface->level[l]);
    mem_free(surface);
}

/* First and last pixel whose centre lies within `radius` of `at`, clipped to the level. */
static void span(double at, double radius, int size, int range[2])
{
    range[0] = (int)fmin(fmax(ceil(at - radius - 0.5), 0), size);
    range[1] = (int)fmax(fmin(floor(at + radius - 0.5), size - 1), -1);
}

/* Lines `first`, first + stride, ... of the pixels that a row covers. */
struct lines { int first, stride; };

static void add_image(struct surface *surface, const struct surface_rows *rows, int64_t n, const double at[2],
                      struct lines lines)
{
    const double radius = fmax(2 * (double)rows->h[n] * rows->h_unit, narrowest);
    int l = 0, size = SURFACE_SIZE, x[2], y[2];
    double pixel = 1;
    const float scale = (float)(4 * rows->mass[n] / (radius * radius));     /* mass / h^2 */
    for (; l < LEVELS - 1 && radius >= widest * pixel; l++, size /= 2) pixel *= 2;
    span(at[0] / pixel, radius / pixel, size, x);
    span(at[1] / pixel, radius / pixel, size, y);
    const float entries = (float)(TABLE * pixel * pixel / (radius * radius)), weight = rows->value ? rows->value[n] : 0;
    const int skip = (lines.first - y[0] % lines.stride + lines.stride) % lines.stride;
    for (int j = y[0] + skip; j <= y[1]; j += lines.stride) {
        float (*line)[2] = surface->level[l] + (int64_t)j * size;
        float dy = (float)(j + 0.5 - at[1] / pixel), left = (float)(0.5 - at[0] / pixel);
        for (int i = x[0]; i <= x[1]; i++) {
            float dx = (float)i + left, entry = (dx * dx + dy * dy) * entries;
            if (entry >= TABLE) continue;
            float share = scale * surface->column[(int)entry];
            line[i][0] += share;
            line[i][1] += share * weight;
        }
    }
}

/* The row wherever it is seen: at its place and whole sides from it. */
static void add_row(struct surface *surface, const struct surface_rows *rows, int64_t n, struct lines lines)
{
    const double *at = rows->at[n], radius = fmax(2 * (double)rows->h[n] * rows->h_unit, narrowest);
    int first[2] = {0, 0}, last[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        if (!(rows->side[k] > 0)) continue;
        first[k] = (int)ceil((-radius - at[k]) / rows->side[k]);
        last[k] = (int)floor((SURFACE_SIZE + radius - at[k]) / rows->side[k]);
    }
    for (int j = first[1]; j <= last[1]; j++)
        for (int i = first[0]; i <= last[0]; i++)
            add_image(surface, rows, n, (const double[]){at[0] + i * rows->side[0], at[1] + j * rows->side[1]}, lines);
}

/* Each thread lays all rows, onto lines of its own. */
void surface_add(struct surface *surface, const struct surface_rows *rows)
{
#pragma omp parallel if (rows->n > 1)
    {
        const struct lines lines = {omp_get_thread_num(), omp_get_num_threads()};
        for (int64_t n = 0; n < rows->n; n++)
            if (isfinite(rows->at[n][0] + rows->at[n][1])) add_row(surface, rows, n, lines);
    }
}

void surface_sum_ranks(struct surface *surface)
{
    for (int l = 0, size = SURFACE_SIZE; l < LEVELS; l++, size /= 2) comm_sum_floats(surface->level[l][0], 2 * size * size);
}

/* Adds a level to the next finer one. A fine pixel lies a quarter of a coarse one off its centre. */
static void refine(const float (*coarse)[2], float (*fine)[2], int size)
{
    const int half = size / 2;
#pragma omp parallel for if (size > 100)
    for (int j = 0; j < size; j++) {
        int near_row = j / 2, far_row = j % 2 ? near_row + 1 : near_row - 1;
        far_row = far_row < 0 ? 0 : far_row >= half ? half - 1 : far_row;
        for (int i = 0; i < size; i++) {
            int near = i / 2, far = i % 2 ? near + 1 : near - 1;
            far = far < 0 ? 0 : far >= half ? half - 1 : far;
            const float *a = coarse[near_row * half + near], *b = coarse[near_row * half + far];
            const float *c = coarse[far_row * half + near], *d = coarse[far_row * half + far];
            for (int k = 0; k < 2; k++)
                fine[j * size + i][k] += (9 * a[k] + 3 * b[k] + 3 * c[k] + d[k]) / 16;
        }
    }
}

const float (*surface_finish(struct surface *surface))[2]
{
    for (int l = LEVELS - 1; l > 0; l--)
        refine((const float (*)[2])surface->level[l], surface->level[l - 1], SURFACE_SIZE >> (l - 1));
    return (const float (*)[2])surface->level[0];
}

/* --- smoothing lengths --- */

static int64_t cell(double at, int l) { return (int64_t)floor(ldexp(at, -l)); }

/* Rows in the three by three pixels of a level about a place. */
static float rows_near(float *const count[LEVELS], const double at[2], int l)
{
    const int64_t size = SURFACE_SIZE >> l;
    float rows = 0;
    for (int64_t j = cell(at[1], l) - 1; j <= cell(at[1], l) + 1; j++)
        for (int64_t i = cell(at[0], l) - 1; i <= cell(at[0], l) + 1; i++)
            if (i >= 0 && j >= 0 && i < size && j < size) rows += count[l][j * size + i];
    return rows;
}

void surface_smoothing(const double (*at)[2], int64_t n, bool spread, float *h)
{
    enum { ENOUGH = 40, WITHIN = 64 };
    float *count[LEVELS];       /* as exact as it need be */
    for (int l = 0; l < LEVELS; l++) {
        const int64_t size = SURFACE_SIZE >> l;
        count[l] = mem_array("pictures", float, size * size);
        for (int64_t i = 0; i < n; i++) {
            int64_t x = cell(at[i][0], l), y = cell(at[i][1], l);
            if (x >= 0 && y >= 0 && x < size && y < size) count[l][y * size + x]++;
        }
        if (spread) comm_sum_floats(count[l], (int)(size * size));
    }
    for (int64_t i = 0; i < n; i++) {
        int l = 0;
        float rows = rows_near(count, at[i], 0);
        while (rows < (float)ENOUGH && l < LEVELS - 1) rows = rows_near(count, at[i], ++l);
        double density = (double)fmaxf(rows, 1) / (9 * ldexp(1, 2 * l));
        h[i] = (float)sqrt(WITHIN / (4 * M_PI * density));
    }
    for (int l = 0; l < LEVELS; l++) mem_free(count[l]);
}
