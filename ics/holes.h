/* SPDX-License-Identifier: GPL-3.0-or-later
 * Black holes in a generator's model: one at rest in the centre, or several on a circle about it. */
#ifndef TEPHRA_HOLES_H
#define TEPHRA_HOLES_H
#include "param.h"
#include "sim.h"

struct holes { int64_t n; double mass, distance, speed; };

/* The keys, for a generator whose private state `type` has a struct holes as `field`. */
#define HOLES_PARAMS(type, field) \
    {"holes", PARAM_COUNT, "", "0", 0, 1000, NULL, \
     "black holes among the rows: one in the centre at rest, more on a circle in the plane z = 0 (the block black_holes)", false, \
     offsetof(type, field.n)}, \
    {"hole_mass", PARAM_REAL, "mass", "none", 1e-300, 1e300, NULL, "mass of each, beside that of the model", false, \
     offsetof(type, field.mass)}, \
    {"hole_distance", PARAM_REAL, "length", "none", 1e-300, 1e300, NULL, "radius of their circle", false, \
     offsetof(type, field.distance)}, \
    {"hole_speed", PARAM_REAL, "", "1", 0, 10, NULL, \
     "their speed along it, over that of a circular orbit", false, offsetof(type, field.speed)}

/* Before the rows are made: how many of n are left to the model, 0 and a problem noted if the keys cannot be met. */
int64_t holes_reserve(struct sim *sim, const struct holes *holes, int64_t n);
/* After them: adds the holes. inside: the model's mass within the distance, or 0 without one. */
void holes_make(struct sim *sim, const struct holes *holes, double inside);
#endif
