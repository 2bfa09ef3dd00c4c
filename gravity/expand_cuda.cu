/* SPDX-License-Identifier: GPL-3.0-or-later
 * Local expansions by CUDA: a warp for a group. A turn (warp.cuh) judges up to 32 cells by the error that they make in the
 * group's expansion; those accepted go on a list, and 32 of them at a time, one a lane, are turned into terms that the lane
 * sums in registers. So a cell costs what its derivatives and products cost (some hundred instructions) once a group,
 * not once a row. Then the lanes' sums are added, and the expansion acts on the targets, one a lane.
 *
 * What a cell may not do as a part of the expansion is left to walk_cuda.cu. */
#include "walk.cuh"
#include "cell.h"

/* A cell in units of its own distance, so that no power of it overflows however far it is; terms of order n are worth
 * y^(n + 1) in the group's unit. */
template <int order>
DEVICE void expand_cell(float *sum, const struct walk_eye *eye, const struct walk_field *f, int32_t n)
{
    const struct gravity_cell *cell = &f->cell[n];
    const float3 to = walk_look(eye, cell);
    const float unit1 = (float)eye->unit1, y = rsqrtf(to.x * to.x + to.y * to.y + to.z * to.z), u = cell->scale * unit1 * y;
    const float soft2 = (float)(f->far_soft2 * eye->unit1 * eye->unit1) * y * y;
    const struct cell_vector r = {-y * to.x, -y * to.y, -y * to.z};
    const float *from = f->moment + (int64_t)f->width * n;
    float d[CELL_TERMS(order + 1)], moment[CELL_TERMS(order) - CELL_TERMS(2)], part[order + 1], factor = u * u;
    cell_derivatives(d, r, soft2, order);
#define EXPAND_MOMENT(a, b, c) moment[CELL_MOMENT(a, b, c)] = factor * from[CELL_MOMENT(a, b, c)];
    CELL_ORDER_2(EXPAND_MOMENT)
    factor *= u;
    if (order > 3) { CELL_ORDER_3(EXPAND_MOMENT) }
    factor *= u;
    if (order > 4) { CELL_ORDER_4(EXPAND_MOMENT) }
    factor *= u;
    if (order > 5) { CELL_ORDER_5(EXPAND_MOMENT) }
#undef EXPAND_MOMENT
    part[0] = y;
#pragma unroll
    for (int k = 1; k <= order; k++) part[k] = part[k - 1] * y;
    cell_to_local_scaled(sum, cell->mass, moment, d, part, order);
}

struct __align__(16) expand_memory { int32_t list[2 * LANES]; float local[CELL_TERMS_MAX]; struct warp_stack stack; };

/* The lanes' sums, added in one order, over a! b! c! as cell_at wants them. */
template <int order>
DEVICE void expand_gather(struct expand_memory *m, const float *sum, int lane)
{
#define EXPAND_TERM(a, b, c) { \
    const int factorial[] = {1, 1, 2, 6, 24, 120, 720}; \
    float all = sum[CELL_INDEX(a, b, c)]; \
    for (int lanes = LANES / 2; lanes > 0; lanes /= 2) all += __shfl_xor_sync(~0u, all, lanes); \
    if (lane == 0) m->local[CELL_INDEX(a, b, c)] = all * (1.f / (float)(factorial[a] * factorial[b] * factorial[c])); }
    CELL_ORDER_0(EXPAND_TERM) CELL_ORDER_1(EXPAND_TERM) CELL_ORDER_2(EXPAND_TERM) CELL_ORDER_3(EXPAND_TERM)
    if (order >= 4) { CELL_ORDER_4(EXPAND_TERM) }
    if (order >= 5) { CELL_ORDER_5(EXPAND_TERM) }
    if (order >= 6) { CELL_ORDER_6(EXPAND_TERM) }
#undef EXPAND_TERM
    __syncwarp();
}

/* Targets [from, to), one a lane. */
template <int order>
DEVICE void expand_act(const struct expand_memory *m, const struct walk_eye *eye, const struct walk_field *f,
                       const struct walk_wanted *wanted, int from, int to)
{
    for (int i = from + (int)threadIdx.x; i < to; i += LANES) {
        const struct walk_target target = wanted->target[i];
        const float4 row = f->row[target.row];
        const double *pos = f->cell[target.leaf].pos;
        const float length = (float)(eye->unit1 / f->unit1);
        const struct cell_vector r = {length * (row.x + (float)((pos[0] - eye->centre[0]) * f->unit1)),
                                      length * (row.y + (float)((pos[1] - eye->centre[1]) * f->unit1)),
                                      length * (row.z + (float)((pos[2] - eye->centre[2]) * f->unit1))};
        const struct cell_field a = cell_at(m->local, r, order);
        const double area1 = eye->unit1 * eye->unit1;
        wanted->field[i] = make_float4((float)(area1 * a.x), (float)(area1 * a.y), (float)(area1 * a.z),
                                       (float)(-eye->unit1 * a.depth));
    }
}

template <int order>
static __global__ void __launch_bounds__(LANES, order > 5 ? 8 : 12) walk_expand(struct walk_field f, struct walk_wanted wanted)
{
    __shared__ struct expand_memory m;
    const int group = (int)blockIdx.x, lane = (int)threadIdx.x;
    const struct walk_eye eye = walk_eye_of(&wanted.view[group]);
    float sum[CELL_TERMS(order + 1)] = {};
    int depth = 0, listed = 0;
    unsigned cells = 0;
    for (int32_t n = lane == 0 ? 0 : -1;; n = warp_pop(&m.stack, &depth, lane)) {
        const struct gravity_cell *cell = &f.cell[n < 0 ? 0 : n];
        const int verdict = n < 0 ? GRAVITY_NEAR : walk_by_error(&eye, cell, order, false);
        warp_push(&m.stack, &depth, lane, verdict == GRAVITY_OPEN, cell->child, cell->n_children);
        const int place = warp_place(lane, verdict == GRAVITY_LOCAL, &listed);
        if (verdict == GRAVITY_LOCAL) m.list[place] = n;
        __syncwarp();
        if (listed < LANES && depth > 0) continue;
        const int ready = min(listed, (int)LANES);      /* of the last turn there may be more than these: the loop comes again */
        if (lane < ready) expand_cell<order>(sum, &eye, &f, m.list[lane]);
        cells += (unsigned)ready;
        listed -= ready;
        __syncwarp();
        if (lane < listed) m.list[lane] = m.list[LANES + lane];
        if (depth == 0 && listed == 0) break;
    }
    expand_gather<order>(&m, sum, lane);
    expand_act<order>(&m, &eye, &f, &wanted, wanted.first[group], wanted.first[group + 1]);
    if (lane == 0) atomicAdd(&wanted.counts[0], (unsigned long long)cells);
}

walk_kernel *walk_expand_kernel(int order)
{
    static walk_kernel *const kernels[] = {walk_expand<3>, walk_expand<4>, walk_expand<5>, walk_expand<6>};
    return kernels[order - GRAVITY_ORDER_MIN];
}
