/* SPDX-License-Identifier: GPL-3.0-or-later
 * The walk of a warp for the gas rows in reach of a group: boxes in double, rows in floats about the group's
 * centre, staged into a tile of shared memory, which is handed over whenever it is full. */
#ifndef TEPHRA_SPH_WALK_CUH
#define TEPHRA_SPH_WALK_CUH
#include "device.cuh"
#include "warp.cuh"
extern "C" {
#include "engine.h"
}

enum { TILE = 64, ROOM = TILE + LANES };

/* The rows on the device: place and motion are the two halves of struct sph_place. */
struct sph_field {
    const struct sph_cell *cell;
    const float *h_max;             /* largest smoothing length in each cell; searches do without */
    const int32_t *leaf;
    const float4 *place;            /* two a row: x, y, z, h/2; vx, vy, vz, mass */
    const float4 *state;
};

/* row: of every entry of the groups; NULL: entry i is row own + i. */
struct sph_wanted { int n; const struct sph_group *group; const int32_t *row; int32_t own; };

/* What a pass needs of the rows that it meets. Searches see the mass in place of h/2. */
enum sph_pass { PASS_SEARCH, PASS_DENSITY, PASS_FORCE };

template <sph_pass pass> struct sph_tile_memory { float4 place[ROOM], motion[ROOM]; };
template <> struct sph_tile_memory<PASS_SEARCH> { float4 place[ROOM]; };
template <> struct sph_tile_memory<PASS_FORCE> { float4 place[ROOM], motion[ROOM], state[ROOM]; };

template <sph_pass pass> struct sph_memory { struct sph_tile_memory<pass> tile; struct warp_stack stack; };

/* A warp at work: the same in all lanes but for lane, slot, part and the lane's row. */
template <sph_pass pass> struct sph_warp {
    struct sph_memory<pass> *memory;
    double centre[3];
    float vel[3], low[3], high[3];  /* the box of the rows that look for others */
    int lane, slot, part, parts;    /* which of all rows wanted, and which of the rows that it meets */
    int n, depth, rows;             /* rows of the group; entries in use */
    int32_t row;
    float4 place, motion;           /* of the row */
};

/* Rows within rows + max(least, factor h) of the box are staged. */
struct sph_extent { float rows, least, factor; };

/* What the float arithmetic of the tile may lose against the boxes in double. */
static constexpr float sph_margin = 1 + 1e-5f;

DEVICE float sph_extent_of(struct sph_extent e, float h) { return e.rows + fmaxf(e.least, e.factor * h); }

template <sph_pass pass>
DEVICE bool sph_cell_near(const struct sph_warp<pass> *w, const struct sph_cell *cell, struct sph_extent e, float h_max)
{
    const double reach = (double)sph_extent_of(e, h_max);
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double x = cell->pos[k] - w->centre[k], above = x + (double)cell->low[k] - (double)w->high[k],
                     below = (double)w->low[k] - (x + (double)cell->high[k]), gap = fmax(fmax(above, below), 0.0);
        sum += gap * gap;
    }
    return cell->count > 0 && sum <= (double)sph_margin * reach * reach;
}

template <sph_pass pass>
DEVICE float sph_box_gap2(const struct sph_warp<pass> *w, float4 p)
{
    const float x = fmaxf(fmaxf(p.x - w->high[0], w->low[0] - p.x), 0.f), y = fmaxf(fmaxf(p.y - w->high[1], w->low[1] - p.y), 0.f),
                z = fmaxf(fmaxf(p.z - w->high[2], w->low[2] - p.z), 0.f);
    return x * x + y * y + z * z;
}

/* Place and motion of row i about the group, given those of its leaf. */
template <sph_pass pass>
DEVICE void sph_about(const struct sph_warp<pass> *w, const struct sph_cell *leaf, float4 *place, float4 *motion)
{
    place->x += (float)(leaf->pos[0] - w->centre[0]);
    place->y += (float)(leaf->pos[1] - w->centre[1]);
    place->z += (float)(leaf->pos[2] - w->centre[2]);
    motion->x += leaf->vel[0] - w->vel[0];
    motion->y += leaf->vel[1] - w->vel[1];
    motion->z += leaf->vel[2] - w->vel[2];
}

DEVICE void sph_put(struct sph_tile_memory<PASS_SEARCH> *t, const struct sph_field *, int32_t, int at,
                                               float4 place, float4 motion)
{
    t->place[at] = make_float4(place.x, place.y, place.z, motion.w);
}

DEVICE void sph_put(struct sph_tile_memory<PASS_DENSITY> *t, const struct sph_field *, int32_t, int at,
                                               float4 place, float4 motion)
{
    t->place[at] = place;
    t->motion[at] = motion;
}

DEVICE void sph_put(struct sph_tile_memory<PASS_FORCE> *t, const struct sph_field *f, int32_t i, int at,
                                               float4 place, float4 motion)
{
    t->place[at] = place;
    t->motion[at] = motion;
    t->state[at] = f->state[i];
}

DEVICE void sph_move(struct sph_tile_memory<PASS_SEARCH> *t, int to, int from)
{ t->place[to] = t->place[from]; }

DEVICE void sph_move(struct sph_tile_memory<PASS_DENSITY> *t, int to, int from)
{
    t->place[to] = t->place[from];
    t->motion[to] = t->motion[from];
}

DEVICE void sph_move(struct sph_tile_memory<PASS_FORCE> *t, int to, int from)
{
    t->place[to] = t->place[from];
    t->motion[to] = t->motion[from];
    t->state[to] = t->state[from];
}

/* The rows of a leaf that are in reach go to the tile. */
template <sph_pass pass, class Act>
DEVICE void sph_take_leaf(struct sph_warp<pass> *w, const struct sph_field *f, int32_t n,
                                                     struct sph_extent e, Act act)
{
    const struct sph_cell *leaf = &f->cell[n];
    struct sph_tile_memory<pass> *tile = &w->memory->tile;
    for (int from = 0; from < leaf->count; from += LANES) {
        const int32_t i = leaf->first + min(from + w->lane, leaf->count - 1);
        float4 place = f->place[2 * (int64_t)i], motion = f->place[2 * (int64_t)i + 1];
        sph_about(w, leaf, &place, &motion);
        const float reach = sph_extent_of(e, 2 * place.w);
        const bool take = from + w->lane < leaf->count && sph_box_gap2(w, place) <= sph_margin * reach * reach;
        const int at = warp_place(w->lane, take, &w->rows);
        if (take) sph_put(tile, f, i, at, place, motion);
        if (w->rows < TILE) continue;
        __syncwarp();
        act(TILE);
        __syncwarp();
        w->rows -= TILE;
        if (w->lane < w->rows) sph_move(tile, w->lane, TILE + w->lane);
        __syncwarp();
    }
}

/* Calls act(entries) for every tile of rows in reach: TILE of them, the last time fewer, never 0. */
template <sph_pass pass, class Act>
DEVICE void sph_walk(struct sph_warp<pass> *w, const struct sph_field *f, struct sph_extent e, Act act)
{
    w->depth = w->rows = 0;
    for (int32_t n = w->lane == 0 ? 0 : -1;; n = warp_pop(&w->memory->stack, &w->depth, w->lane)) {
        const struct sph_cell *cell = &f->cell[n < 0 ? 0 : n];
        const float h_max = pass == PASS_SEARCH ? 0.f : f->h_max[n < 0 ? 0 : n];
        const bool near = n >= 0 && sph_cell_near(w, cell, e, h_max), leaf = near && cell->n_children == 0;
        warp_push(&w->memory->stack, &w->depth, w->lane, near && !leaf, cell->child, cell->n_children);
        for (unsigned left = __ballot_sync(~0u, leaf); left != 0; left &= left - 1)
            sph_take_leaf(w, f, __shfl_sync(~0u, n, __ffs((int)left) - 1), e, act);
        __syncwarp();
        if (w->depth == 0) break;
    }
    if (w->rows > 0) act(w->rows);
    __syncwarp();
}

/* The box becomes that of the lanes' rows for which `looking` holds. */
template <sph_pass pass> DEVICE void sph_enclose_rows(struct sph_warp<pass> *w, bool looking)
{
    const float x[3] = {w->place.x, w->place.y, w->place.z};
    for (int k = 0; k < 3; k++) {
        w->high[k] = warp_largest(looking ? x[k] : -3e38f);
        w->low[k] = -warp_largest(looking ? -x[k] : -3e38f);
    }
}

/* The lane's row; false if the warp has no group. */
template <sph_pass pass>
DEVICE bool sph_begin(struct sph_warp<pass> *w, const struct sph_field *f, const struct sph_wanted *wanted,
                                                 struct sph_memory<pass> *memory)
{
    const int warp = (int)(threadIdx.x / LANES), number = (int)(blockIdx.x * (blockDim.x / LANES)) + warp;
    if (number >= wanted->n) return false;
    const struct sph_group group = wanted->group[number];
    w->memory = &memory[warp];
    w->lane = (int)(threadIdx.x % LANES);
    w->n = group.n;
    w->parts = warp_parts(group.n);
    w->slot = group.first + min(w->lane % (LANES / w->parts), group.n - 1);
    w->part = w->lane / (LANES / w->parts);
    for (int k = 0; k < 3; k++) {
        w->centre[k] = group.pos[k];
        w->vel[k] = group.vel[k];
    }
    w->row = wanted->row ? wanted->row[w->slot] : wanted->own + w->slot;
    w->place = f->place[2 * (int64_t)w->row];
    w->motion = f->place[2 * (int64_t)w->row + 1];
    sph_about(w, &f->cell[f->leaf[w->row]], &w->place, &w->motion);
    return true;
}
#endif
