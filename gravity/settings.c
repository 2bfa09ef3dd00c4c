/* SPDX-License-Identifier: GPL-3.0-or-later
 * `accuracy`: settings taken from the measured front. Each entry is a row of doc/charts/gravity.csv (set plummer,
 * N = 1e6): the cheapest whose 99th percentile lies at or below its accuracy. tests/test_gravity.c holds
 * the two together. */
#include "gravity.h"
#include <math.h>

static const struct gravity_front fmm_front[] = {
    {0.1, "fmm order 3 0.01", 3, 0.01, 1.613e-02, 0.3610},
    {0.01, "fmm order 4 0.01", 4, 0.01, 7.932e-03, 0.3660},
    {0.003, "fmm order 4 0.001", 4, 0.001, 2.229e-03, 0.4324},
    {0.001, "fmm order 5 0.0003", 5, 0.0003, 9.959e-04, 0.6420},
    {0.0003, "fmm order 5 3e-05", 5, 3e-05, 1.780e-04, 1.2652},
    {0.0001, "fmm order 6 1e-05", 6, 1e-05, 5.946e-05, 1.8684},
    {.row = NULL},
};
static const struct gravity_front tree_front[] = {
    {0.1, "tree order 1 1.2", 1, 1.2, 1.979e-02, 0.5375},
    {0.01, "tree order 1 1", 1, 1, 8.618e-03, 0.6305},
    {0.003, "tree order 2 0.8", 2, 0.8, 2.538e-03, 1.3573},
    {0.001, "tree order 2 0.6", 2, 0.6, 7.837e-04, 2.2829},
    {0.0003, "tree order 2 0.45", 2, 0.45, 2.615e-04, 3.8922},
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
