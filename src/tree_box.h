/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: boxes and speeds of cells, about rows. */
#ifndef TEPHRA_TREE_BOX_H
#define TEPHRA_TREE_BOX_H
#include "sim.h"
#include "tree_fit.h"

/* How fast a row is now, and by how much its velocity may change until its step ends. */
static inline double row_velocity(const struct sim *sim, const struct species *s, int64_t i, double vel[3])
{
    const struct timeline *time = &sim->time;
    double lag = timeline_lag(time, s->rung[i], s->rung0[i]), change = 0;
    for (int k = 0; k < 3; k++) {
        double acc = s->acc[i][k];
        vel[k] = integrate_velocity(s->vel[i][k], acc, lag);
        change = larger(change, fabs(acc));
    }
    return change * timeline_seconds(time, (int64_t)1 << s->rung[i]);
}

static inline void widen_for_row(const struct sim *sim, struct node *node, const struct species *s, int64_t i)
{
    double pos[3], vel[3], change = row_velocity(sim, s, i, vel);
    sim_predict(&sim->time, s, i, pos);
    for (int k = 0; k < 3; k++) {
        double x = pos[k] - node->pos[k];
        widen(node, k, x, x);
        node->speed = (float)larger(node->speed, above(fabs(vel[k] - (double)node->vel[k]) + change));
    }
}

static inline bool is_own_leaf(const struct node *node) { return node->n_children == 0 && node->place == NODE_OWN; }
#endif
