/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: centres, boxes and speeds of cells, as tree.c and tree_cuda.cu compute them, operation by
 * operation, so that both make the same cells bit for bit. */
#ifndef TEPHRA_TREE_FIT_H
#define TEPHRA_TREE_FIT_H
#include "hd.h"
#include "tree.h"
#include <math.h>

/* Plain comparisons become one instruction each; fmin and fmax are calls. */
HD double smaller(double a, double b) { return a < b ? a : b; }
HD double larger(double a, double b) { return a > b ? a : b; }

/* A bound in float that certainly holds x. */
HD float below(double x) { return (float)x - 1.2e-7f * fabsf((float)x); }
HD float above(double x) { return (float)x + 1.2e-7f * fabsf((float)x); }

/* A box and a speed that hold nothing yet. */
HD void open_box(struct node *node)
{
    for (int k = 0; k < 3; k++) {
        node->low[k] = INFINITY;
        node->high[k] = -INFINITY;
    }
    node->speed = node->slack = 0;
}

HD void widen(struct node *node, int k, double low, double high)
{
    node->low[k] = (float)smaller(node->low[k], below(low));
    node->high[k] = (float)larger(node->high[k], above(high));
}

HD void widen_for_child(struct node *node, const struct node *child)
{
    for (int k = 0; k < 3; k++) {
        double x = child->pos[k] - node->pos[k], v = fabs((double)child->vel[k] - (double)node->vel[k]);
        widen(node, k, x + (double)child->low[k], x + (double)child->high[k]);
        node->speed = (float)larger(node->speed, above(v + (double)child->speed));
    }
}

/* Sums for the mean position and velocity. */
struct centre { double weight, pos[3], vel[3]; };

HD void centre_set(struct node *node, const struct centre *c, double mass)
{
    node->mass = (float)mass;
    for (int k = 0; k < 3; k++) {
        node->pos[k] = c->pos[k] / c->weight;
        node->vel[k] = (float)(c->vel[k] / c->weight);
    }
    open_box(node);
}

/* Centre and box of a cell with children. */
HD void measure_inner(const struct node *all, struct node *node)
{
    struct centre c = {0, {0, 0, 0}, {0, 0, 0}};
    double mass = 0;
    for (int32_t k = 0; k < node->n_children; k++) mass += (double)all[node->child + k].mass;
    for (int32_t k = 0; k < node->n_children; k++) {
        const struct node *child = &all[node->child + k];
        const double weight = mass > 0 ? (double)child->mass : (double)node_rows(child, ALL_SPECIES);
        c.weight += weight;
        for (int d = 0; d < 3; d++) {
            c.pos[d] += weight * child->pos[d];
            c.vel[d] += weight * (double)child->vel[d];
        }
    }
    centre_set(node, &c, mass);
    for (int32_t k = 0; k < node->n_children; k++) widen_for_child(node, &all[node->child + k]);
}

/* Modules hold the rows of a leaf or a group as floats about its centre, with errors of up to 2^-24 of its
 * extent: 1.5e-5 of the distance of the closest rows at this ratio. One escaper at 1e7 radii, or two clumps
 * that far apart, go beyond; of cells of 128 random rows 0.2 % do. */
HD bool is_stretched(const struct node *node, double closest)
{
    const double ratio = 256;
    double extent = 0;
    for (int k = 0; k < 3; k++) extent = larger(extent, (double)node->high[k] - (double)node->low[k]);
    return extent > ratio * closest;
}
#endif
