/* SPDX-License-Identifier: GPL-3.0-or-later
 * Density and force of SPH by CUDA, and the engine's host side. A lane has one row of the group (several lanes
 * share one where few are active). Of each tile of rows in reach it first marks in the bits of a word those that
 * it meets, about one in eight, and then sums over these alone: so lanes part ways over few rows. Search: search_cuda.cu. */
#include "walk.cuh"
#include "kernels.cuh"
extern "C" {
#include "mem.h"
}

enum { PAIR_WARPS = 4 };

DEVICE struct sph_place sph_place_of(float4 place, float4 motion)
{
    struct sph_place p = {place.x, place.y, place.z, place.w, motion.x, motion.y, motion.z, motion.w};
    return p;
}

DEVICE struct sph_state sph_state_of(float4 state)
{
    struct sph_state s = {state.x, state.y, state.z, state.w};
    return s;
}

/* Which of the first n rows of the tile this lane meets. */
template <sph_pass pass>
DEVICE unsigned long long sph_met(const struct sph_warp<pass> *w, struct sph_meet meet, int n)
{
    const float h = 2 * w->place.w;
    unsigned long long met = 0;
    for (int j = w->part; j < n; j += w->parts) {
        const float4 p = w->memory->tile.place[j];
        const float x = p.x - w->place.x, y = p.y - w->place.y, z = p.z - w->place.z,
                    r = meet.own * h + fmaxf(meet.least * h, 2 * meet.other * p.w);
        if (x * x + y * y + z * z <= sph_margin * r * r) met |= 1ull << j;
    }
    return met;
}

/* All rows that a row of the group may meet. */
template <sph_pass pass>
DEVICE struct sph_extent sph_mutual_extent(const struct sph_warp<pass> *w, struct sph_meet meet)
{
    const float h = warp_largest(2 * w->place.w);
    struct sph_extent e = {meet.own * h, meet.least * h, meet.other};
    return e;
}

/* Adds up the parts of lanes that share a row. */
template <sph_pass pass> DEVICE float sph_whole(const struct sph_warp<pass> *w, float part)
{
    for (int lanes = LANES / w->parts; lanes < LANES; lanes *= 2) part += __shfl_xor_sync(~0u, part, lanes);
    return part;
}

template <int kernel, bool grad_h>
static __global__ void __launch_bounds__(LANES * PAIR_WARPS) sph_density_rows(struct sph_field f, struct sph_wanted wanted,
                                                                              struct sph_meet meet, struct sph_density *out)
{
    __shared__ struct sph_memory<PASS_DENSITY> memory[PAIR_WARPS];
    struct sph_warp<PASS_DENSITY> w;
    if (!sph_begin(&w, &f, &wanted, memory)) return;
    sph_enclose_rows(&w, true);
    const struct sph_place own = sph_place_of(w.place, w.motion);
    struct sph_density s = {};
    sph_walk(&w, &f, sph_mutual_extent(&w, meet), [&](int n) {
        const struct sph_tile_memory<PASS_DENSITY> *t = &w.memory->tile;
        for (unsigned long long met = sph_met(&w, meet, n); met != 0; met &= met - 1) {
            const int j = __ffsll((long long)met) - 1;
            const struct sph_place other = sph_place_of(t->place[j], t->motion[j]);
            const struct sph_density d = sph_density_pair(own, other, (enum sph_kernel)kernel, grad_h);
            s.rho += d.rho;
            s.div += d.div;
            s.curl_x += d.curl_x;
            s.curl_y += d.curl_y;
            s.curl_z += d.curl_z;
            if (grad_h) s.swell += d.swell;
        }
    });
    float *const sums[] = {&s.rho, &s.div, &s.curl_x, &s.curl_y, &s.curl_z, &s.swell};
#pragma unroll
    for (int k = 0; k < 6; k++) *sums[k] = sph_whole(&w, *sums[k]);
    if (w.lane < w.n) out[w.slot] = s;
}

template <int kernel, bool grad_h>
static __global__ void __launch_bounds__(LANES * PAIR_WARPS) sph_force_rows(struct sph_field f, struct sph_wanted wanted,
                                                                            struct sph_plan plan, struct species gas)
{
    __shared__ struct sph_memory<PASS_FORCE> memory[PAIR_WARPS];
    struct sph_warp<PASS_FORCE> w;
    if (!sph_begin(&w, &f, &wanted, memory)) return;
    sph_enclose_rows(&w, true);
    const struct sph_place own = sph_place_of(w.place, w.motion);
    const struct sph_state own_state = sph_state_of(f.state[w.row]);
    const bool conducting = plan.visc.conduct > 0.f;
    struct sph_force s = {};
    sph_walk(&w, &f, sph_mutual_extent(&w, plan.meet), [&](int n) {
        const struct sph_tile_memory<PASS_FORCE> *t = &w.memory->tile;
        for (unsigned long long met = sph_met(&w, plan.meet, n); met != 0; met &= met - 1) {
            const int j = __ffsll((long long)met) - 1;
            const struct sph_place other = sph_place_of(t->place[j], t->motion[j]);
            const struct sph_state state = sph_state_of(t->state[j]);
            const struct sph_force p = sph_force_pair(own, own_state, other, state, plan.visc, (enum sph_kernel)kernel, grad_h,
                                                      plan.signal);
            if (conducting) s.du += sph_conduct_pair(own, own_state, other, state, plan.visc, (enum sph_kernel)kernel, grad_h);
            s.ax += p.ax;
            s.ay += p.ay;
            s.az += p.az;
            s.du += p.du;
            s.signal = fmaxf(s.signal, p.signal);
        }
    });
    float *const sums[] = {&s.ax, &s.ay, &s.az, &s.du};
#pragma unroll
    for (int k = 0; k < 4; k++) *sums[k] = sph_whole(&w, *sums[k]);
    for (int lanes = LANES / w.parts; lanes < LANES; lanes *= 2)
        s.signal = fmaxf(s.signal, __shfl_xor_sync(~0u, s.signal, lanes));
    if (w.lane >= w.n) return;
    float *const acc = gas.acc[w.row];
    acc[0] += s.ax;
    acc[1] += s.ay;
    acc[2] += s.az;
    if (gas.du) gas.du[w.row] += s.du;
    if (gas.signal) gas.signal[w.row] = s.signal;
}

typedef void density_kernel(struct sph_field, struct sph_wanted, struct sph_meet, struct sph_density *);
typedef void force_kernel(struct sph_field, struct sph_wanted, struct sph_plan, struct species);

/* [kernel][grad_h] */
#define BOTH(name, kernel) {name<kernel, false>, name<kernel, true>}
#define ALL(name) {BOTH(name, SPH_CUBIC), BOTH(name, SPH_WENDLAND_C2), BOTH(name, SPH_WENDLAND_C4)}
static density_kernel *const density_kernels[SPH_KERNELS][2] = ALL(sph_density_rows);
static force_kernel *const force_kernels[SPH_KERNELS][2] = ALL(sph_force_rows);
#undef ALL
#undef BOTH

/* Blocks of the device that grow with what they are to hold. */
enum sph_column { CELL, LENGTH, LEAF, PLACE, GROUP, COLUMNS };

struct sph_engine {
    struct device *device;
    int warps;
    struct { void *at; size_t bytes; } block[COLUMNS];
    struct sph_field field;
    struct sph_wanted wanted;
    int32_t cells;
};

struct sph_engine *sph_engine_create(struct device *device, int warps)
{
    struct sph_engine *e = (struct sph_engine *)mem_alloc("sph", sizeof *e);
    e->device = device;
    e->warps = warps ? warps : PAIR_WARPS;
    return e;
}

void sph_engine_free(struct sph_engine *e)
{
    if (!e) return;
    for (int c = 0; c < COLUMNS; c++) device_free(e->device, e->block[c].at);
    mem_free(e);
}

static void *reserve(struct sph_engine *e, enum sph_column column, size_t bytes)
{
    if (bytes <= e->block[column].bytes) return e->block[column].at;
    device_free(e->device, e->block[column].at);
    e->block[column].bytes = bytes + bytes / 16;
    e->block[column].at = device_alloc(e->device, "gas", e->block[column].bytes);
    return e->block[column].at;
}

static void *send(struct sph_engine *e, enum sph_column column, const void *from, size_t bytes)
{
    void *to = reserve(e, column, bytes);
    device_upload(e->device, to, from, bytes);
    return to;
}

void sph_engine_cells(struct sph_engine *e, const struct sph_cell *cell, int32_t n)
{
    e->cells = n;
    e->field.cell = (const struct sph_cell *)send(e, CELL, cell, (size_t)n * sizeof *cell);
    e->field.h_max = (const float *)reserve(e, LENGTH, (size_t)n * sizeof(float));
}

void sph_engine_places(struct sph_engine *e, const struct sph_rows *rows)
{
    const size_t n = (size_t)rows->gas.n;
    int32_t *leaf = (int32_t *)reserve(e, LEAF, n * sizeof *leaf);
    struct sph_place *place = (struct sph_place *)reserve(e, PLACE, n * sizeof *place);
    e->field.leaf = leaf;
    e->field.place = (const float4 *)place;
    sph_launch_leaves(e->device, e->field.cell, e->cells, leaf);
    sph_launch_places(e->device, &e->field, rows, place);
}

void sph_engine_lengths(struct sph_engine *e, const struct sph_rows *rows, float *h_max)
{
    sph_launch_lengths(e->device, e->field.cell, e->cells, rows, (float *)e->block[LENGTH].at);
    device_download(e->device, h_max, e->field.h_max, (size_t)e->cells * sizeof *h_max);
}

void sph_engine_groups(struct sph_engine *e, const struct sph_groups *groups)
{
    e->wanted.n = groups->n;
    e->wanted.group = (const struct sph_group *)send(e, GROUP, groups->group, (size_t)groups->n * sizeof *groups->group);
}

/* The groups' rows as the lists on the device have them. */
static struct sph_wanted wanted_of(const struct sph_engine *e, const struct sph_rows *rows)
{
    struct sph_wanted wanted = e->wanted;
    wanted.row = rows->gas.active;
    wanted.own = (int32_t)rows->gas.own;
    return wanted;
}

static dim3 grid_of(const struct sph_engine *e) { return dim3((unsigned)((e->wanted.n + e->warps - 1) / e->warps)); }
static dim3 block_of(const struct sph_engine *e) { return dim3((unsigned)(LANES * e->warps)); }

void sph_engine_search(struct sph_engine *e, const struct sph_plan *plan, const struct sph_quest *quest,
                       const struct sph_rows *rows)
{
    if (e->wanted.n == 0) return;
    device_launch(e->device, "sph_search_rows", sph_search_kernel(quest->smooth ? 1 + plan->kernel : 0),
                  dim3((unsigned)e->wanted.n), dim3(LANES), e->field, wanted_of(e, rows), *quest, plan->law, *rows);
}

void sph_engine_density(struct sph_engine *e, const struct sph_plan *plan, const struct sph_rows *rows)
{
    if (e->wanted.n == 0) return;
    struct sph_density *sum = (struct sph_density *)rows->scratch;
    device_launch(e->device, "sph_density_rows", density_kernels[plan->kernel][plan->law.grad_h], grid_of(e),
                  block_of(e), e->field, wanted_of(e, rows), plan->meet, sum);
    sph_launch_finish(e->device, plan->law, rows, sum);
}

void sph_engine_force(struct sph_engine *e, const struct sph_plan *plan, const struct sph_rows *rows)
{
    if (e->wanted.n == 0) return;
    struct sph_state *state = (struct sph_state *)rows->scratch;
    e->field.state = (const float4 *)state;
    sph_launch_states(e->device, plan->law, rows, state);
    device_launch(e->device, "sph_force_rows", force_kernels[plan->kernel][plan->law.grad_h], grid_of(e),
                  block_of(e), e->field, wanted_of(e, rows), *plan, rows->gas);
}
