/* SPDX-License-Identifier: GPL-3.0-or-later
 * `accuracy`: settings taken from the measured front. Each entry is a row of doc/charts/gravity.csv (four sets,
 * N = 1e5): the cheapest whose 99th percentile lies at or below its accuracy on every set. tests/test_gravity_front.c
 * holds the two together. */
#include "gravity.h"
#include <math.h>

static const struct gravity_front fmm_front[] = {
    {0.1, "fmm order 3 0.01", 3, 0.01, 2.219e-02, 0.395},
    {0.01, "fmm order 4 0.003", 4, 0.003, 5.928e-03, 0.518},
    {0.003, "fmm order 4 0.001", 4, 0.001, 2.751e-03, 0.58},
    {0.001, "fmm order 5 0.0003", 5, 0.0003, 7.754e-04, 0.859},
    {0.0003, "fmm order 6 0.0001", 6, 0.0001, 2.686e-04, 1.304},
    {0.0001, "fmm order 6 1e-05", 6, 1e-05, 4.410e-05, 2.345},
    {.row = NULL},
};
static const struct gravity_front tree_front[] = {
    {0.1, "tree order 1 1.2", 1, 1.2, 7.540e-02, 0.454},
    {0.01, "tree order 2 0.8", 2, 0.8, 7.462e-03, 1.008},
    {0.003, "tree order 2 0.6", 2, 0.6, 2.311e-03, 1.685},
    {0.001, "tree order 2 0.45", 2, 0.45, 6.803e-04, 2.544},
    {.row = NULL},
};

const struct gravity_front *gravity_settings_front(enum gravity_solver solver)
{ return solver == SOLVER_FMM ? fmm_front : tree_front; }

const struct gravity_front *gravity_settings_row(enum gravity_solver solver, double accuracy)
{
    const struct gravity_front *front = gravity_settings_front(solver);
    while (front[1].row && accuracy < front->accuracy) front++;
    return front;
}

void gravity_settings(struct gravity_opening *o, double accuracy)
{
    const struct gravity_front *front = gravity_settings_row(o->solver, accuracy);
    /* Between the measured points, and beyond the last, the error goes as alpha and as the power 2.5 of the angle. */
    const double part = fmin(1, accuracy / front->accuracy);
    o->order = front->order;
    o->theta = front->opening * pow(part, 1 / 2.5);
    o->alpha = front->opening * part;
    o->leaf_size = o->solver == SOLVER_FMM ? 48 : 32;
    o->group_size = o->solver == SOLVER_FMM ? 128 : o->solver == SOLVER_TREE ? 512 : 256;
}
