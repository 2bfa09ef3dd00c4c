/* SPDX-License-Identifier: GPL-3.0-or-later
 * Black holes: star rows that are marked by the column `hole` and have a softening of their own. */
#ifndef TEPHRA_BLACK_HOLES_H
#define TEPHRA_BLACK_HOLES_H
#include "sim.h"

/* The block black_holes has no more pairs with a rate of hardening than this. */
enum { BLACK_HOLE_PAIRS = 64 };

struct black_hole_pair { uint64_t id[2]; double time, inverse_axis; };

struct black_holes {
    double softening;
    struct black_hole_pair last[BLACK_HOLE_PAIRS];  /* bound at the last record; saved */
    int64_t n_last;                                 /* saved */
};

static inline bool black_hole_is(const struct species *s, int64_t i) { return s->hole && s->hole[i]; }
#endif
