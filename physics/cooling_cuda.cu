/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cooling by CUDA: see cooling_engine.h. */
#include "device.cuh"
extern "C" {
#include "cooling_engine.h"
#include "mem.h"
}

enum { BLOCK = 128, SUMS = N_RESERVOIRS + 1 };      /* the last one: the largest u */

/* The memory there of all curves; law: as kernels see it. */
struct cooling_engine {
    struct device *device;
    struct cooling_law law;
    void **block;
    int n_blocks;
    double (*part)[SUMS], (*home)[SUMS];
    int64_t parts;
};

/* A copy there, given back with the engine. */
static void *put(struct cooling_engine *e, const void *from, size_t bytes)
{
    void *to = device_alloc(e->device, "cooling", bytes);
    device_upload(e->device, to, from, bytes);
    e->block = (void **)mem_resize("cooling", e->block, (size_t)(e->n_blocks + 1) * sizeof *e->block);
    return e->block[e->n_blocks++] = to;
}

static struct cooling_curve *put_curve(struct cooling_engine *e, const struct cooling_curve *curve)
{
    struct cooling_curve there = *curve;
    there.node = (struct cooling_node *)put(e, curve->node, (size_t)curve->n * sizeof *curve->node);
    there.hint = (uint16_t *)put(e, curve->hint, (size_t)curve->n_hint * sizeof *curve->hint);
    there.t = NULL;
    if (curve->balance) {
        struct cooling_balance balance = *curve->balance;
        for (int l = 0; l < balance.n_levels; l++)
            for (int way = 0; way < COOLING_WAYS; way++)
                balance.level[l].rule[way] = (struct cooling_rule *)put(e, balance.level[l].rule[way],
                                                                        balance.level[l].n * sizeof(struct cooling_rule));
        there.balance = (struct cooling_balance *)put(e, &balance, sizeof balance);
    }
    return (struct cooling_curve *)put(e, &there, sizeof there);
}

struct cooling_engine *cooling_engine_create(struct device *device, const struct cooling_law *law)
{
    struct cooling_engine *e = (struct cooling_engine *)mem_alloc("cooling", sizeof *e);
    const struct cooling_curve **bin = mem_array("cooling", const struct cooling_curve *, law->n_bins);
    e->device = device;
    e->law = *law;
    for (int b = 0; b < law->n_bins; b++) bin[b] = put_curve(e, law->bin[b]);
    e->law.bin = (const struct cooling_curve *const *)put(e, bin, (size_t)law->n_bins * sizeof *bin);
    mem_free(bin);
    return e;
}

void cooling_engine_free(struct cooling_engine *e)
{
    if (!e) return;
    for (int b = 0; b < e->n_blocks; b++) device_free(e->device, e->block[b]);
    device_free(e->device, e->part);
    mem_free(e->block);
    mem_free(e->home);
    mem_free(e);
}

/* A thread a row; a block adds up what its rows book, pairwise. */
static __global__ void __launch_bounds__(BLOCK) cooling_rows(struct cooling_law law, struct timeline time, struct species rows,
                                                             double (*part)[SUMS])
{
    __shared__ double sum[SUMS][BLOCK];
    const int thread = (int)threadIdx.x;
    const int64_t a = (int64_t)blockIdx.x * BLOCK + thread;
    double booked[N_RESERVOIRS] = {0}, hottest = 0;
    if (a < rows.n_active) {
        const int64_t i = rows.active ? rows.active[a] : rows.own + a;
        hottest = (double)rows.u[i];
        cooling_row(&law, &rows, i, timeline_step(&time, rows.rung0[i]), booked);
    }
    for (int k = 0; k < N_RESERVOIRS; k++) sum[k][thread] = booked[k];
    sum[N_RESERVOIRS][thread] = hottest;
    for (int half = BLOCK / 2; half > 0; half /= 2) {
        __syncthreads();
        for (int k = 0; k < N_RESERVOIRS && thread < half; k++) sum[k][thread] += sum[k][thread + half];
        if (thread < half) sum[N_RESERVOIRS][thread] = fmax(sum[N_RESERVOIRS][thread], sum[N_RESERVOIRS][thread + half]);
    }
    __syncthreads();
    if (thread < SUMS) part[blockIdx.x][thread] = sum[thread][0];
}

void cooling_engine_advance(struct cooling_engine *e, const struct timeline *time, const struct species *rows,
                            double booked[N_RESERVOIRS], float *hottest)
{
    const int64_t blocks = (rows->n_active + BLOCK - 1) / BLOCK;
    if (blocks == 0) return;
    if (blocks > e->parts) {
        device_free(e->device, e->part);
        e->part = (double (*)[SUMS])device_alloc(e->device, "cooling", (size_t)blocks * sizeof *e->part);
        e->home = (double (*)[SUMS])mem_resize("cooling", e->home, (size_t)blocks * sizeof *e->home);
        e->parts = blocks;
    }
    device_launch(e->device, "cooling_rows", cooling_rows, dim3((unsigned)blocks), dim3(BLOCK), e->law, *time, *rows, e->part);
    device_download(e->device, e->home, e->part, (size_t)blocks * sizeof *e->part);
    for (int64_t b = 0; b < blocks && device_sound(e->device); b++) {
        for (int k = 0; k < N_RESERVOIRS; k++) booked[k] += e->home[b][k];
        *hottest = fmaxf(*hottest, (float)e->home[b][N_RESERVOIRS]);
    }
}
