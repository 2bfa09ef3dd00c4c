/* SPDX-License-Identifier: GPL-3.0-or-later
 * The gas rows nearest to a place, through the tree's boxes. */
#ifndef TEPHRA_NEAREST_H
#define TEPHRA_NEAREST_H
#include "sim.h"

enum { NEAREST_MOST = 256 };
struct nearest { int n; int32_t row[NEAREST_MOST]; double r2[NEAREST_MOST]; };  /* by distance, then row */

/* The `count` gas rows nearest to a place now, the nearest image of each; fewer if there are fewer. */
void nearest_gas(const struct sim *sim, const double pos[3], int count, struct nearest *nearest);
/* Square of the least distance from a place to the box of a cell now, its nearest image. */
static inline double nearest_gap2(const struct sim *sim, const struct node *node, const double pos[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double low = (double)node->low[k], high = (double)node->high[k];
        double x = pos[k] - node->pos[k];
        if (sim->box.side[k] > 0) x += box_shift(&sim->box, k, x - 0.5 * (low + high));
        double gap = x < low ? low - x : x > high ? x - high : 0;
        sum += gap * gap;
    }
    return sum;
}
#endif
