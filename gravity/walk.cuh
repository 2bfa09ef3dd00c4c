/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the two kernels of the grouped walk share: sources, wanted groups, and what a group decides about a cell. */
#ifndef TEPHRA_GRAVITY_WALK_CUH
#define TEPHRA_GRAVITY_WALK_CUH
#include "device.cuh"
#include "real_device.cuh"
#include "warp.cuh"
#include "judge.h"
extern "C" {
#include "walk_engine.h"
}

/* By an angle with monopoles or quadrupoles (solver tree), or by an error (solver fmm). */
enum walk_rule { MONOPOLES, QUADRUPOLES, BY_ERROR };
/* On the stack of a walk: the children of this cell go into no local expansion. A tree has fewer cells. */
enum { NO_LOCAL = 1 << 28 };

/* The sources on the device. */
struct walk_field {
    const struct gravity_cell *cell;
    const struct gravity_leaf *leaf;
    const float *moment;
    int width, order;
    const float4 *row;
    const float *soft;
    double unit1, far_soft2;        /* one over the unit of pairs */
};

struct walk_wanted {
    int n;
    const struct gravity_view *view;
    const int32_t *first;
    const struct walk_target *target;
    float4 *field;
    unsigned long long *counts;     /* cells, pairs */
};

typedef void walk_kernel(struct walk_field, struct walk_wanted);

/* expand_cuda.cu: local expansions of the groups, by error and of this order (3 to 6), evaluated at their targets: sets field.
 * One warp a block. */
walk_kernel *walk_expand_kernel(int order);

/* A group that looks at cells. */
struct walk_eye { const struct gravity_view *view; double centre[3], unit1; };

DEVICE struct walk_eye walk_eye_of(const struct gravity_view *view)
{
    struct walk_eye eye = {view, {view->centre[0], view->centre[1], view->centre[2]}, 1 / view->unit};
    return eye;
}

/* From the group's centre to a cell's, in the group's unit. */
DEVICE float3 walk_look(const struct walk_eye *eye, const struct gravity_cell *cell)
{
    return make_float3((float)((cell->pos[0] - eye->centre[0]) * eye->unit1), (float)((cell->pos[1] - eye->centre[1]) * eye->unit1),
                       (float)((cell->pos[2] - eye->centre[2]) * eye->unit1));
}

DEVICE int walk_by_angle(const struct walk_eye *eye, const struct gravity_cell *cell)
{
    const struct gravity_view *v = eye->view;
    const float3 r = walk_look(eye, cell);
    if (judge_angle(cell->reach * (float)eye->unit1, judge_box2(r.x, r.y, r.z, v->half), v->theta2, v->support, v->near2))
        return GRAVITY_FAR;
    return cell->n_children == 0 ? GRAVITY_NEAR : GRAVITY_OPEN;
}

DEVICE int walk_by_error(const struct walk_eye *eye, const struct gravity_cell *cell, int order, bool no_local)
{
    const struct gravity_view *v = eye->view;
    const float3 r = walk_look(eye, cell);
    const float unit1 = (float)eye->unit1, d2 = r.x * r.x + r.y * r.y + r.z * r.z;
    const struct judge_source s = {cell->mass, cell->reach * unit1, cell->scale * unit1, cell->power};
    judge_mask too_large = true;
    if (!no_local && judge_local(s, v, d2, order, v->support, &too_large)) return GRAVITY_LOCAL;
    if (judge_cell(s, v, judge_box2(r.x, r.y, r.z, v->half), v->support)) return GRAVITY_FAR;
    return cell->n_children == 0 ? GRAVITY_NEAR : too_large ? GRAVITY_OPEN_FAR : GRAVITY_OPEN;
}
#endif
