/* SPDX-License-Identifier: GPL-3.0-or-later
 * Surface density on a square of pixels: each row is spread with the column density of its kernel. */
#ifndef TEPHRA_SURFACE_H
#define TEPHRA_SURFACE_H
#include <stdbool.h>
#include <stdint.h>

struct surface;
enum { SURFACE_SIZE = 704 };    /* pixels a side: 11 * 2^6, so that it can be halved six times */

struct surface *surface_new(void);
void surface_free(struct surface *surface);
/* n rows: positions in pixels (rows at no finite place are left out), smoothing lengths in pixels over h_unit, masses,
 * and what is averaged by mass (NULL: 0). Every pixel adds up the rows in their order, on any number of threads. */
struct surface_rows {
    int64_t n;
    const double (*at)[2];
    const float *h;
    double h_unit;
    const double *mass;
    const float *value;
    double side[2];     /* where space closes on itself after so many pixels the rows are seen again; 0: it does not */
};
void surface_add(struct surface *surface, const struct surface_rows *rows);
/* Of spread rows, after the last of each rank's own: what all ranks have added, on all of them. */
void surface_sum_ranks(struct surface *surface);
/* After the last row. Pixel i + SURFACE_SIZE * j holds {mass per pixel, mass times value}. */
const float (*surface_finish(struct surface *surface))[2];

/* Smoothing lengths, in pixels, of n rows that have none: from their number density in projection,
 * about 64 rows within 2h; `spread`: of the rows of all ranks, each of which has its own here. */
void surface_smoothing(const double (*at)[2], int64_t n, bool spread, float *h);
#endif
