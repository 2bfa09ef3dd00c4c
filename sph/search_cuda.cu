/* SPDX-License-Identifier: GPL-3.0-or-later
 * The search for smoothing lengths by CUDA. The first walk collects, for every row of a group, the squared distances
 * of the rows within its reach; the turns of the search (search.h) then look at these alone. Where a row has more
 * in reach than there is room for, every turn walks anew. Rows that find too few look 1.3 times as far. */
#include "walk.cuh"
#include "kernels.cuh"
extern "C" {
#include "search.h"
}

/* What a turn gathers of the rows in reach, and what it keeps of them: of a search for the n-th neighbour. There is room for
 * what 50 neighbours need where they lie 1.05^3 times denser than expected, and half as much again. */
struct sph_count {
    enum { KEPT = 96 };
    struct kept { float r2[KEPT][LANES]; };
    float at;
    struct sph_split split;

    static __device__ __forceinline__ void keep(kept *k, int j, int lane, float r2, float) { k->r2[j][lane] = r2; }
    static __device__ __forceinline__ struct sph_bracket first(float guess, float limit) { return sph_exact_begin(guess, limit); }
    __device__ __forceinline__ void begin(float t)
    {
        at = t;
        split.count = split.below = 0.f;
        split.above = SPH_FAR;
    }
    __device__ __forceinline__ void add(float r2, float)
    {
        const bool less = r2 < at;
        split.count += less ? 1.f : 0.f;
        split.below = less ? fmaxf(split.below, r2) : split.below;
        split.above = less ? split.above : fminf(split.above, r2);
    }
    __device__ __forceinline__ void add(const kept *k, int j, int lane) { add(k->r2[j][lane], 0.f); }
    __device__ __forceinline__ void end(struct sph_bracket *b, float target, float, float nearest, int round) const
    {
        sph_exact_turn(b, split, target, nearest, round);
    }
};

/* The same of a search for the sum of kernels; room for a quarter more than expected. */
template <int kernel> struct sph_weight {
    enum { KEPT = 72 };
    struct kept { float r2[KEPT][LANES], mass[KEPT][LANES]; };
    float h1, sum, slope;

    static __device__ __forceinline__ void keep(kept *k, int j, int lane, float r2, float mass)
    {
        k->r2[j][lane] = r2;
        k->mass[j][lane] = mass;
    }
    static __device__ __forceinline__ struct sph_bracket first(float guess, float limit) { return sph_smooth_begin(guess, limit); }
    __device__ __forceinline__ void begin(float h)
    {
        h1 = 1.f / h;
        sum = slope = 0.f;
    }
    __device__ __forceinline__ void add(float r2, float mass)
    {
        const float q = sqrtf(r2) * h1, m = mass * SPH_PI;
        sum += m * sph_kernel(q, (enum sph_kernel)kernel);
        slope -= m * q * sph_kernel_slope(q, (enum sph_kernel)kernel);
    }
    __device__ __forceinline__ void add(const kept *k, int j, int lane) { add(k->r2[j][lane], k->mass[j][lane]); }
    __device__ __forceinline__ void end(struct sph_bracket *b, float target, float mass, float nearest, int round) const
    {
        sph_smooth_turn(b, sum, slope, target * mass, nearest, round);
    }
};

DEVICE float sph_distance2(const struct sph_warp<PASS_SEARCH> *w, float4 p)
{
    const float x = p.x - w->place.x, y = p.y - w->place.y, z = p.z - w->place.z;
    return x * x + y * y + z * z;
}

/* The squared radius within which the lane's row finds what it wants, if that lies within its reach, else SPH_FAR; of lanes
 * that are not looking nothing. widest: the longest reach of those that are. */
template <class Turn>
DEVICE float sph_look(struct sph_warp<PASS_SEARCH> *w, typename Turn::kept *kept, const struct sph_field *f,
                                                 const struct sph_quest *quest, float reach, float widest)
{
    const struct sph_extent extent = {widest, 0.f, 0.f};
    const float limit = reach * reach;
    float nearest = SPH_FAR;
    int count = 0;
    sph_walk(w, f, extent, [&](int n) {
        for (int j = 0; j < n; j++) {
            const float4 p = w->memory->tile.place[j];
            const float r2 = sph_distance2(w, p);
            if (r2 > 0.f) nearest = fminf(nearest, r2);
            if (!(r2 < limit)) continue;
            if (count < Turn::KEPT) Turn::keep(kept, count, w->lane, r2, p.w);
            count++;
        }
    });
    const bool all = __all_sync(~0u, count <= Turn::KEPT);
    struct sph_bracket bracket = Turn::first(limit / (quest->margin * quest->margin), limit);
    bracket.open = reach > 0.f;
    for (int round = 1; __any_sync(~0u, bracket.open); round++) {
        Turn turn;
        turn.begin(bracket.at);
        if (all)
            for (int j = 0; j < count; j++) turn.add(kept, j, w->lane);
        else
            sph_walk(w, f, extent, [&](int n) {
                for (int j = 0; j < n; j++) turn.add(sph_distance2(w, w->memory->tile.place[j]), w->memory->tile.place[j].w);
            });
        if (bracket.open) turn.end(&bracket, quest->target, w->motion.w, nearest, round);
    }
    return bracket.radius2 < limit ? bracket.radius2 : SPH_FAR;
}

/* How far the lane's row looks first. */
DEVICE float sph_first_reach(const struct sph_warp<PASS_SEARCH> *w, const struct sph_field *f, const struct sph_quest *quest,
                             struct sph_law law, const struct sph_rows *rows)
{
    const struct species *gas = &rows->gas;
    const float step = (float)timeline_step(&rows->time, gas->rung0[w->row]);
    if (gas->h[w->row] > 0) return 2 * quest->margin * fmaxf(sph_row_h_expected(gas, w->row, 0, step), (float)law.h_min);
    int32_t n = f->leaf[w->row];
    while (f->cell[n].parent >= 0 && (float)f->cell[n].count < quest->rows) n = f->cell[n].parent;
    const struct sph_cell *cell = &f->cell[n];
    float extent = 0;
    for (int k = 0; k < 3; k++) extent = fmaxf(extent, cell->high[k] - cell->low[k]);
    return sph_guess_reach(extent, quest->rows, (float)cell->count);
}

template <class Turn>
static __global__ void __launch_bounds__(LANES) sph_search_rows(struct sph_field f, struct sph_wanted wanted,
                                                                struct sph_quest quest, struct sph_law law, struct sph_rows rows)
{
    __shared__ struct sph_memory<PASS_SEARCH> memory[1];
    __shared__ typename Turn::kept kept;
    struct sph_warp<PASS_SEARCH> w;
    if (!sph_begin(&w, &f, &wanted, memory)) return;
    float reach = sph_first_reach(&w, &f, &quest, law, &rows), widest, radius2 = SPH_FAR;   /* 0: the row has what it wants */
    while ((widest = warp_largest(reach)) > 0.f) {
        sph_enclose_rows(&w, reach > 0.f);
        const float found = sph_look<Turn>(&w, &kept, &f, &quest, reach, widest);
        if (reach > 0.f) radius2 = found;
        reach = found < SPH_FAR || reach >= quest.most ? 0.f : 1.3f * reach;
    }
    if (w.lane >= w.n) return;
    float *h = &rows.gas.h[w.row];
    if (radius2 < SPH_FAR) *h = sph_row_length(law, radius2, quest.scale);
    else if (!(*h > 0)) *h = quest.lone;
}

search_kernel *sph_search_kernel(int which)
{
    static search_kernel *const kernels[1 + SPH_KERNELS] = {
        sph_search_rows<sph_count>, sph_search_rows<sph_weight<SPH_CUBIC>>, sph_search_rows<sph_weight<SPH_WENDLAND_C2>>,
        sph_search_rows<sph_weight<SPH_WENDLAND_C4>>};
    return kernels[which];
}
