/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to the tree on a device: what sort_cuda.cu (rows, keys, order) and tree_cuda.cu (cells) share. */
#ifndef TEPHRA_TREE_CUH
#define TEPHRA_TREE_CUH
#include "device.cuh"
extern "C" {
#include "integrate.h"
#include "key.h"
#include "mem.h"
#include "tree_engine.h"
#include "tree_fit.h"
}

enum { THREADS = 128, LANES = 32 };

/* Columns of a species on the device: as they lie, but for `order` and the keys, which are sorted. */
struct tree_table {
    int n;
    const double *pos, *vel, *mass;
    const float *acc;
    const uint64_t *id;
    const uint8_t *rung, *rung0;
    const int32_t *order;
    const uint64_t *high, *low;
};

struct tree_tables { struct tree_table of[N_SPECIES]; };

/* What is counted on the device and read by the host. */
struct tree_counts { int32_t cells, bad, long_ties; };

enum { LEVELS_MAX = KEY_LEVELS + 4 };
enum tree_block { EXTENT, COUNTS, CELLS, BELOW, NUMBER, BEHIND, NODES, CLOSEST, SPLIT, OFFSET, TEMPORARY,
                  SCRATCH, SPARE, N_BLOCKS };
enum tree_column { HIGH, LOW, HIGH_SORTED, LOW_SORTED, ORDER, N_TREE_COLUMNS };

struct tree_memory { void *at; size_t bytes; };

struct tree_engine {
    struct device *device;
    struct tree_memory block[N_BLOCKS], column[N_SPECIES][N_TREE_COLUMNS];
    struct timeline time;
    struct tree_tables tables;
    int32_t room, nodes;            /* cells for which there is room; cells there are */
    int levels, level[LEVELS_MAX];  /* where each begins */
    int rounds, round[LEVELS_MAX];  /* where the nodes of each round of splits begin */
};

/* sort_cuda.cu: every species by its keys in this cube. */
struct tree_cube { double corner[3], scale; };
void tree_sort(struct tree_engine *engine, struct tree_cube cube);

DEVICE void tree_predict(const struct timeline *time, const struct tree_table *s, int i, double pos[3])
{
    const double t = timeline_lag(time, s->rung[i], s->rung0[i]);
    for (int j = 3 * i, k = 0; k < 3; k++, j++)
        pos[k] = t == 0 ? s->pos[j] : integrate_position(s->pos[j], s->vel[j], (double)s->acc[j], t);
}

DEVICE int tree_thread(void) { return (int)(blockIdx.x * blockDim.x + threadIdx.x); }

/* A block that grows. */
static inline void *reserve(struct tree_engine *e, struct tree_memory *block, size_t bytes)
{
    if (bytes <= block->bytes) return block->at;
    device_free(e->device, block->at);
    block->bytes = bytes + bytes / 16;
    block->at = device_alloc(e->device, "tree", block->bytes);
    if (!block->at) block->bytes = 0;
    return block->at;
}

static inline struct tree_counts *counts_of(struct tree_engine *e) { return (struct tree_counts *)e->block[COUNTS].at; }

static inline struct tree_counts read_counts(struct tree_engine *e)
{
    struct tree_counts counts = {};
    device_download(e->device, &counts, counts_of(e), sizeof counts);
    return counts;
}

static inline void write_counts(struct tree_engine *e, struct tree_counts counts)
{
    reserve(e, &e->block[COUNTS], sizeof counts);
    device_upload(e->device, counts_of(e), &counts, sizeof counts);
}

static inline dim3 blocks_for(int64_t threads, int block) { return dim3((unsigned)((threads + block - 1) / block)); }
#endif
