/* SPDX-License-Identifier: GPL-3.0-or-later
 * Clouds that a cloud may have met during its step, through the tree's boxes. */
#ifndef TEPHRA_PARTNERS_H
#define TEPHRA_PARTNERS_H
#include "collide.h"
#include "sim.h"

/* State now of a cloud row, its radius included. */
struct body partners_body(const struct sim *sim, int32_t row);

struct partners { int32_t *row; int32_t n, capacity; double speed; };

/* The other clouds that `row` can have come within reach of within `span`, and the largest relative speed of them; then all
 * that lie within the way of that speed, since one that is deflected may meet any of them. widest: radius that no cloud
 * exceeds. The list is empty at first; any thread. */
void partners_find(const struct sim *sim, int32_t row, double span, double widest, struct partners *list);
#endif
