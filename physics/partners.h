/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clouds that may have met within the steps that end now, found through the tree's boxes. */
#ifndef TEPHRA_PARTNERS_H
#define TEPHRA_PARTNERS_H
#include "meetings.h"
#include "sim.h"
#include <math.h>

/* Radius of a cloud: `radius` at 1e6 Msun, ~ mass^power; suns: a code unit of mass in Msun. */
struct cloud_size { double radius, power, suns; };
static inline double cloud_radius(const struct cloud_size *size, double mass)
{
    const double x = mass * size->suns / 1e6;
    return size->radius * (size->power == 0.5 ? sqrt(x) : pow(x, size->power));
}

/* State now of a cloud row, its radius included. */
struct body partners_body(const struct sim *sim, const struct cloud_size *size, int32_t row);

/* Clouds whose step ends now, those that they may have met, and each couple of them once. */
struct partners {
    struct party *party;
    struct couple *couple;
    int32_t n;
    int64_t couples;
};

/* Brings the radii of the tree's cells up to date: those above `rows` rows, ascending; `row` NULL: all. */
void partners_measure(struct sim *sim, const struct cloud_size *size, const int32_t *row, int64_t rows);
/* For each cloud whose step ends now: the clouds that can have come within its reach within its step, and the largest relative
 * speed of them, which is noted in speed[row]; then all that lie within the way of that speed, since one that is deflected may
 * meet any of them. The cells' radii are known. */
void partners_gather(struct sim *sim, const struct cloud_size *size, float *speed, struct partners *partners);
void partners_free(struct partners *partners);
#endif
