/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows, keys and their order by CUDA, bit for bit those of the CPU: the same operations in the same order (compiled without
 * fused products and sums, Makefile.am). A row a thread; CUB sorts by the upper halves of the keys, ties go by the lower
 * half and the id. */
#include "cub.cuh"
#include "tree.cuh"

enum { TIE = 32, BLOCKS_MAX = 256 };

/* Least and largest coordinates of what the threads of a warp have met: 6 numbers a warp. */
static __global__ void tree_extent(struct timeline time, struct tree_table s, double *extent, struct tree_counts *counts)
{
    const double inf = INFINITY;
    double low[3] = {inf, inf, inf}, high[3] = {-inf, -inf, -inf};
    for (int i = tree_thread(); i < s.n; i += (int)(gridDim.x * blockDim.x)) {
        double pos[3];
        tree_predict(&time, &s, i, pos);
        if (!isfinite(pos[0] + pos[1] + pos[2])) counts->bad = 1;
        for (int k = 0; k < 3; k++) {
            low[k] = smaller(pos[k], low[k]);
            high[k] = larger(pos[k], high[k]);
        }
    }
    for (int k = 0; k < 3; k++)
        for (int lanes = LANES / 2; lanes > 0; lanes /= 2) {
            low[k] = smaller(low[k], __shfl_xor_sync(~0u, low[k], lanes));
            high[k] = larger(high[k], __shfl_xor_sync(~0u, high[k], lanes));
        }
    if (threadIdx.x % LANES > 0) return;
    double *to = extent + 6 * (tree_thread() / LANES);
    for (int k = 0; k < 3; k++) {
        to[k] = low[k];
        to[3 + k] = high[k];
    }
}

static __global__ void tree_keys(struct timeline time, struct tree_table s, struct tree_cube cube, uint64_t *high, uint64_t *low,
                                 int32_t *order)
{
    const int i = tree_thread();
    if (i >= s.n) return;
    double pos[3];
    uint64_t x[3];
    tree_predict(&time, &s, i, pos);
    key_grid(pos, cube.corner, cube.scale, x);
    high[i] = key_interleave(x, KEY_HALF);
    low[i] = key_interleave(x, 0);
    order[i] = i;
}

/* Rows whose upper half keys agree, few of them: in order of the lower half, then of their ids, by insertion. */
static __global__ void tree_ties(int n, const uint64_t *high, const uint64_t *low, const uint64_t *id, int32_t *order,
                                 struct tree_counts *counts)
{
    const int i = tree_thread();
    if (i + 1 >= n || high[i + 1] != high[i] || (i > 0 && high[i - 1] == high[i])) return;
    int end = i + 2;
    while (end < n && end - i <= TIE && high[end] == high[i]) end++;
    if (end - i > TIE) {
        counts->long_ties = 1;
        return;
    }
    for (int k = i + 1; k < end; k++) {
        const int32_t row = order[k];
        int at = k;
        for (; at > i; at--) {
            const int32_t before = order[at - 1];
            if (low[before] < low[row] || (low[before] == low[row] && id[before] < id[row])) break;
            order[at] = before;
        }
        order[at] = row;
    }
}

static __global__ void tree_gather(int n, const uint64_t *from, const int32_t *order, uint64_t *to)
{
    const int i = tree_thread();
    if (i < n) to[i] = from[order[i]];
}

static __global__ void tree_count_up(int n, int32_t *order)
{
    const int i = tree_thread();
    if (i < n) order[i] = i;
}

bool tree_engine_rows(struct tree_engine *e, const struct timeline *time, const struct tree_rows rows[N_SPECIES],
                                 double extent[2][3])
{
    const int warps = BLOCKS_MAX * THREADS / LANES;
    double part[BLOCKS_MAX * THREADS / LANES][6];
    write_counts(e, (struct tree_counts){0, 0, 0});
    reserve(e, &e->block[EXTENT], sizeof part);
    e->time = *time;
    for (int k = 0; k < 3; k++) {
        extent[0][k] = INFINITY;
        extent[1][k] = -INFINITY;
    }
    for (int s = 0; s < N_SPECIES; s++) {
        const struct tree_rows *r = &rows[s];
        struct tree_table *t = &e->tables.of[s];
        *t = (struct tree_table){};
        t->n = r->n;
        if (r->n == 0) continue;
        t->pos = (const double *)r->pos;
        t->vel = (const double *)r->vel;
        t->mass = r->mass;
        t->acc = (const float *)r->acc;
        t->id = r->id;
        t->rung = r->rung;
        t->rung0 = r->rung0;
        device_launch(e->device, "tree_extent", tree_extent, dim3(BLOCKS_MAX), dim3(THREADS), e->time, *t,
                      (double *)e->block[EXTENT].at, counts_of(e));
        device_download(e->device, part, e->block[EXTENT].at, sizeof part);
        for (int w = 0; w < warps && device_sound(e->device); w++)
            for (int k = 0; k < 3; k++) {
                extent[0][k] = smaller(extent[0][k], part[w][k]);
                extent[1][k] = larger(extent[1][k], part[w][3 + k]);
            }
    }
    return !read_counts(e).bad;
}

/* Stable, by 64-bit keys, with the rows they belong to. */
static void sort_pairs(struct tree_engine *e, const uint64_t *key, uint64_t *key_out, const int32_t *row, int32_t *row_out, int n)
{
    size_t bytes = 0;
    cudaStream_t stream = device_stream(e->device);
    if (!device_sound(e->device)) return;
    cub::DeviceRadixSort::SortPairs(NULL, bytes, key, key_out, row, row_out, n, 0, 64, stream);
    void *temporary = reserve(e, &e->block[TEMPORARY], bytes);
    if (!device_sound(e->device)) return;
    device_launching(e->device, "tree_sort");
    cub::DeviceRadixSort::SortPairs(temporary, bytes, key, key_out, row, row_out, n, 0, 64, stream);
    device_launched(e->device, "tree_sort");
}

static void sort_species(struct tree_engine *e, int s, struct tree_cube cube)
{
    struct tree_table *t = &e->tables.of[s];
    const size_t n = (size_t)t->n;
    const dim3 grid = blocks_for(t->n, THREADS), block(THREADS);
    uint64_t *high = (uint64_t *)reserve(e, &e->column[s][HIGH], n * sizeof *high),
             *low = (uint64_t *)reserve(e, &e->column[s][LOW], n * sizeof *low),
             *sorted = (uint64_t *)reserve(e, &e->column[s][HIGH_SORTED], n * sizeof *sorted),
             *lower = (uint64_t *)reserve(e, &e->column[s][LOW_SORTED], n * sizeof *lower);
    int32_t *order = (int32_t *)reserve(e, &e->column[s][ORDER], n * sizeof *order),
            *row = (int32_t *)reserve(e, &e->block[SCRATCH], n * sizeof *row);
    device_launch(e->device, "tree_keys", tree_keys, grid, block, e->time, *t, cube, high, low, row);
    sort_pairs(e, high, sorted, row, order, t->n);
    device_launch(e->device, "tree_ties", tree_ties, grid, block, t->n, (const uint64_t *)sorted, (const uint64_t *)low, t->id,
                  order, counts_of(e));
    if (read_counts(e).long_ties) {     /* many rows in one cell of the upper grid: by id, then lower, then upper halves */
        uint64_t *key = (uint64_t *)reserve(e, &e->block[SPARE], n * sizeof *key);
        write_counts(e, (struct tree_counts){0, 0, 0});
        device_launch(e->device, "tree_count_up", tree_count_up, grid, block, t->n, order);
        sort_pairs(e, t->id, sorted, order, row, t->n);
        device_launch(e->device, "tree_gather", tree_gather, grid, block, t->n, (const uint64_t *)low, (const int32_t *)row, key);
        sort_pairs(e, key, sorted, row, order, t->n);
        device_launch(e->device, "tree_gather", tree_gather, grid, block, t->n, (const uint64_t *)high, (const int32_t *)order,
                      key);
        sort_pairs(e, key, sorted, order, row, t->n);
        struct tree_memory swap = e->column[s][ORDER];
        e->column[s][ORDER] = e->block[SCRATCH];
        e->block[SCRATCH] = swap;
        order = row;
    }
    device_launch(e->device, "tree_gather", tree_gather, grid, block, t->n, (const uint64_t *)low, (const int32_t *)order, lower);
    t->order = order;
    t->high = sorted;
    t->low = lower;
}

void tree_sort(struct tree_engine *e, struct tree_cube cube)
{
    for (int s = 0; s < N_SPECIES; s++)
        if (e->tables.of[s].n > 0) sort_species(e, s, cube);
}

void tree_engine_order(struct tree_engine *e, int s, int32_t *order)
{
    device_download(e->device, order, e->tables.of[s].order, (size_t)e->tables.of[s].n * sizeof *order);
}
