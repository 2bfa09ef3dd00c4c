/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree: keys, sort and cells made on a device, bit for bit those of the CPU (tree_cells.c, tree.c).
 * tree_cuda.cu is built where nvcc works, tree_none.c elsewhere; tree_device.c stands between them and the tree. */
#ifndef TEPHRA_TREE_ENGINE_H
#define TEPHRA_TREE_ENGINE_H
#include "timeline.h"
#include "tree.h"

struct device;
struct tree_engine;

/* Rows of a species as they lie now, on the device. */
struct tree_rows {
    int32_t n;
    const double (*pos)[3], (*vel)[3], *mass;
    const float (*acc)[3];
    const uint64_t *id;
    const uint8_t *rung, *rung0;
};

struct tree_engine *tree_engine_create(struct device *device);
void tree_engine_free(struct tree_engine *engine);
/* Predicts the rows to now; they stay where they are until the cells are made. extent: least and largest coordinate of each
 * axis; false if one is not finite. */
bool tree_engine_rows(struct tree_engine *engine, const struct timeline *time, const struct tree_rows rows[N_SPECIES],
                      double extent[2][3]);
/* Sorts by the keys in this cube and makes the cells; returns how many. corner, side, leaf_size, blur: of the tree. */
int32_t tree_engine_build(struct tree_engine *engine, const struct tree *tree);
/* order[i]: where the row that belongs at place i lies now. */
void tree_engine_order(struct tree_engine *engine, int species, int32_t *order);
void tree_engine_nodes(struct tree_engine *engine, struct node *node);
#endif
