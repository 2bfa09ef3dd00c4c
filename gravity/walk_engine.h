/* SPDX-License-Identifier: GPL-3.0-or-later
 * The solvers `tree` and `fmm` on a device: one warp walks the tree for one group of target rows and sums, as it
 * goes, what acts on them. walk_cuda.cu is built where nvcc works, walk_none.c elsewhere.
 *
 * Opening and formulas are the CPU's (judge.h, cell.h, pair.h), so a group meets the same cells and
 * rows as there. The order of a target's sum depends on the tree and its group alone, not on the
 * shape of the launch. A warp's stack has room for the deepest tree there can be (walk_cuda.cu), so
 * no walk runs over. */
#ifndef TEPHRA_GRAVITY_WALK_ENGINE_H
#define TEPHRA_GRAVITY_WALK_ENGINE_H
#include "kernels.h"

struct device;
struct walk_engine;

/* Rows of a group for which a walk of the device is made: two a lane of a warp. */
enum { WALK_GROUP = 64 };

/* What acts: cells with their moments, and the rows of the leaves about their leaf's centre. */
struct walk_sources {
    int32_t n_cells;
    int64_t n_rows;
    const struct gravity_cell *cell;
    const struct gravity_leaf *leaf;    /* one a cell */
    const float *moment;                /* `width` a cell, 0: monopoles */
    int width;
    int order;                          /* 1, 2: by an angle, as monopoles or quadrupoles; 3 to 6: by an error */
    const struct gravity_source *row;
    const float *soft;                  /* one a row; NULL where softening is common */
    int form;                           /* enum softening_form */
    double unit;                        /* of length, in pairs of rows */
    double far_soft2;                   /* softening squared between cells; between rows where it is common */
};

/* A row whose force is wanted and the leaf that holds it. */
struct walk_target { int32_t row, leaf; };
/* Group i: targets [first[i], first[i + 1]), seen as view[i]. */
struct walk_groups {
    int32_t n;
    const struct gravity_view *view;
    const int32_t *first;
    const struct walk_target *target;
};

/* warps of a block: 1, 2 or 4; 0 chooses. */
struct walk_engine *walk_engine_create(struct device *device, int warps);
void walk_engine_free(struct walk_engine *engine);
/* Sends the sources; they stay until the next call. */
void walk_engine_sources(struct walk_engine *engine, const struct walk_sources *sources);
/* field[i] of target i: acceleration and potential, with G as in the sources' masses; no row feels
 * itself. Sets nothing if the device failed (device_error). */
void walk_engine_sum(struct walk_engine *engine, const struct walk_groups *groups, float (*field)[4]);
/* Cells and rows that acted in the last sum, counted once a target. */
struct walk_counts { int64_t cells, pairs; };
struct walk_counts walk_engine_counts(struct walk_engine *engine);
#endif
