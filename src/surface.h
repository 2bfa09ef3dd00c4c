/* SPDX-License-Identifier: GPL-3.0-or-later
 * Surface density on a square of pixels: each row is spread with the column density of its kernel. */
#ifndef TEPHRA_SURFACE_H
#define TEPHRA_SURFACE_H
#include <stdint.h>

struct surface;
enum { SURFACE_SIZE = 704 };    /* pixels a side: 11 * 2^6, so that it can be halved six times */

struct surface *surface_new(void);
void surface_free(struct surface *surface);
/* x, y, h: position and smoothing length in pixels; value: what is averaged by mass. */
void surface_add(struct surface *surface, const double at[2], double h, double mass, double value);
/* After the last row. Pixel i + SURFACE_SIZE * j holds {mass per pixel, mass times value}. */
const float (*surface_finish(struct surface *surface))[2];

/* Smoothing lengths, in pixels, of n rows that have none: from their number density in projection,
 * about 64 rows within 2h. */
void surface_smoothing(const double (*at)[2], int64_t n, float *h);
#endif
