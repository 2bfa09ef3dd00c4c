/* SPDX-License-Identifier: GPL-3.0-or-later
 * Direct summation by CUDA. The sources are cut into chunks and a chunk into tiles; a block of
 * threads holds a few targets a thread in registers, loads tile after tile into shared memory, sums
 * a tile in float and the tiles in double; a second kernel adds the chunks in order. A pair of
 * floats for a position (Gaburov, Harfst & Portegies Zwart 2009, sec. 2.2) costs 6 more additions a
 * row pair. Formulas: pair.h. */
#include "device.cuh"
#include "real_device.cuh"
#include "pair.h"
#include <math.h>
extern "C" {
#include "direct_engine.h"
#include "mem.h"
}

enum { TILE = 128, CHUNK = 32 * TILE, MANY = 4, PART_BYTES = 1 << 28 };

struct __align__(16) direct_sum { double x, y, z, depth; };

/* Rows on the device: a position's leading floats with the mass, its trailing floats with the softening. */
struct direct_columns { float4 *lead, *trail; int32_t *own; int n, capacity; };

struct target { float4 lead, trail; int own; float x, y, z, depth; };

struct direct_engine {
    struct device *device;
    int form, threads;
    enum direct_precision precision;
    double centre[3], scale, mass;      /* of what the device computes in */
    struct direct_columns source, target;
    struct direct_sum *part;            /* of every chunk and target */
    size_t part_bytes;
    struct { float4 *lead, *trail; int32_t *own; struct direct_sum *sum; int capacity; } host;
};

/* One source on the `count` targets of a thread. */
template <int count, bool paired, softening_form form, bool own>
DEVICE void direct_add(struct target *t, float4 lead, float4 trail, int index)
{
#pragma unroll
    for (int k = 0; k < count; k++) {
        float dx = lead.x - t[k].lead.x, dy = lead.y - t[k].lead.y, dz = lead.z - t[k].lead.z;
        if (paired) {
            dx += trail.x - t[k].trail.x;
            dy += trail.y - t[k].trail.y;
            dz += trail.z - t[k].trail.z;
        }
        float mass = own && index == t[k].own ? 0.f : lead.w;
        /* A softening that all rows share starts the sum of squares instead of being added to it. */
        struct pair p = form == SOFT_COMMON
                            ? pair_newton(2 * t[k].trail.w + dx * dx + dy * dy + dz * dz, mass)
                            : pair_any(form, dx * dx + dy * dy + dz * dz, mass, trail.w + t[k].trail.w);
        t[k].x += p.pull * dx;
        t[k].y += p.pull * dy;
        t[k].z += p.pull * dz;
        t[k].depth += p.depth;
    }
}

/* Sums of one tile, in float, added to the targets' sums in double. */
template <int count, bool paired, softening_form form>
DEVICE void direct_tile(struct target *t, struct direct_sum *sum, const float4 *lead,
                                                   const float4 *trail, int first)
{
    bool own = false;
#pragma unroll
    for (int k = 0; k < count; k++) {
        t[k].x = t[k].y = t[k].z = t[k].depth = 0.f;
        own = own || (unsigned)(t[k].own - first) < TILE;
    }
    if (own) {
        for (int j = 0; j < TILE; j++) direct_add<count, paired, form, true>(t, lead[j], trail[j], first + j);
    } else {
#pragma unroll 4
        for (int j = 0; j < TILE; j++) direct_add<count, paired, form, false>(t, lead[j], trail[j], first + j);
    }
#pragma unroll
    for (int k = 0; k < count; k++) {
        sum[k].x += (double)t[k].x;
        sum[k].y += (double)t[k].y;
        sum[k].z += (double)t[k].z;
        sum[k].depth += (double)t[k].depth;
    }
}

/* Block (b, c): targets b * count * threads and on, from the sources of chunk c. */
template <int count, bool paired, softening_form form>
static __global__ void __launch_bounds__(256, 2) direct_chunk(struct direct_columns targets,
                                                           struct direct_columns sources, struct direct_sum *part)
{
    __shared__ float4 lead[TILE], trail[TILE];
    struct target t[count];
    struct direct_sum sum[count];
    int thread = (int)threadIdx.x, threads = (int)blockDim.x, first = (int)blockIdx.x * threads * count + thread;
#pragma unroll
    for (int k = 0; k < count; k++) {
        int i = min(first + k * threads, targets.n - 1);
        t[k].lead = targets.lead[i];
        t[k].trail = targets.trail[i];
        t[k].own = targets.own[i];
        sum[k].x = sum[k].y = sum[k].z = sum[k].depth = 0;
    }
    int from = (int)blockIdx.y * CHUNK, to = min(from + CHUNK, sources.n);
    for (int tile = from; tile < to; tile += TILE) {
        __syncthreads();
        for (int j = thread; j < TILE; j += threads) {
            lead[j] = sources.lead[tile + j];
            trail[j] = sources.trail[tile + j];
        }
        __syncthreads();
        direct_tile<count, paired, form>(t, sum, lead, trail, tile);
    }
#pragma unroll
    for (int k = 0; k < count; k++)
        if (first + k * threads < targets.n) part[(size_t)blockIdx.y * targets.n + first + k * threads] = sum[k];
}

/* Adds the chunks of every target in order, into the first. */
static __global__ void direct_reduce(struct direct_sum *part, int targets, int chunks)
{
    int i = (int)(blockIdx.x * blockDim.x + threadIdx.x);
    if (i >= targets) return;
    struct direct_sum sum = part[i];
    for (int c = 1; c < chunks; c++) {
        struct direct_sum more = part[(size_t)c * targets + i];
        sum.x += more.x;
        sum.y += more.y;
        sum.z += more.z;
        sum.depth += more.depth;
    }
    part[i] = sum;
}

typedef void direct_kernel(struct direct_columns, struct direct_columns, struct direct_sum *);

/* By count (1, MANY), precision and form. */
#define FORMS(count, paired) \
    { direct_chunk<count, paired, SOFT_COMMON>, direct_chunk<count, paired, SOFT_PLUMMER>, \
      direct_chunk<count, paired, SOFT_SPLINE> }
static direct_kernel *const direct_kernels[2][2][3] = {{FORMS(1, false), FORMS(1, true)},
                                                       {FORMS(MANY, false), FORMS(MANY, true)}};
#undef FORMS

struct direct_engine *direct_engine_create(struct device *device, int form, enum direct_precision precision,
                                           int threads)
{
    struct direct_engine *e = (struct direct_engine *)mem_alloc("direct", sizeof *e);
    e->device = device;
    e->form = form;
    e->precision = precision;
    e->threads = threads;
    return e;
}

static void direct_release(struct device *device, struct direct_columns *c)
{
    device_free(device, c->lead);
    device_free(device, c->trail);
    device_free(device, c->own);
    *c = (struct direct_columns){};
}

void direct_engine_free(struct direct_engine *e)
{
    if (!e) return;
    direct_release(e->device, &e->source);
    direct_release(e->device, &e->target);
    device_free(e->device, e->part);
    mem_free(e->host.lead);
    mem_free(e->host.trail);
    mem_free(e->host.own);
    mem_free(e->host.sum);
    mem_free(e);
}

/* Room for n rows on the device, and as much on the host. */
static void direct_reserve(struct direct_engine *e, struct direct_columns *c, int n)
{
    if (n > c->capacity) {
        direct_release(e->device, c);
        c->lead = (float4 *)device_alloc(e->device, "direct", (size_t)n * sizeof *c->lead);
        c->trail = (float4 *)device_alloc(e->device, "direct", (size_t)n * sizeof *c->trail);
        c->own = (int32_t *)device_alloc(e->device, "direct", (size_t)n * sizeof *c->own);
        c->capacity = n;
    }
    if (n > e->host.capacity) {
        e->host.lead = (float4 *)mem_resize("direct", e->host.lead, (size_t)n * sizeof *e->host.lead);
        e->host.trail = (float4 *)mem_resize("direct", e->host.trail, (size_t)n * sizeof *e->host.trail);
        e->host.own = (int32_t *)mem_resize("direct", e->host.own, (size_t)n * sizeof *e->host.own);
        e->host.sum = (struct direct_sum *)mem_resize("direct", e->host.sum, (size_t)n * sizeof *e->host.sum);
        e->host.capacity = n;
    }
}

/* Sends rows [from, from + n), padded to `padded` by rows without mass at the centre. */
static void direct_send(struct direct_engine *e, struct direct_columns *c, const struct direct_rows *rows,
                        int64_t from, int n, int padded)
{
    direct_reserve(e, c, padded);
    for (int i = 0; i < padded; i++) {
        float lead[3] = {0}, trail[3] = {0};
        for (int k = 0; k < 3 && i < n; k++) {
            double x = (rows->pos[from + i][k] - e->centre[k]) / e->scale;
            lead[k] = (float)x;
            trail[k] = (float)(x - (double)lead[k]);
        }
        float mass = i < n && rows->mass ? (float)(rows->mass[from + i] / e->mass) : 0.f;
        float soft = (float)((double)rows->soft[from + (i < n ? i : 0)] / (e->scale * e->scale));
        e->host.lead[i] = make_float4(lead[0], lead[1], lead[2], mass);
        e->host.trail[i] = make_float4(trail[0], trail[1], trail[2], soft);
        e->host.own[i] = i < n && rows->own ? rows->own[from + i] : -1;
    }
    device_upload(e->device, c->lead, e->host.lead, (size_t)padded * sizeof *c->lead);
    device_upload(e->device, c->trail, e->host.trail, (size_t)padded * sizeof *c->trail);
    device_upload(e->device, c->own, e->host.own, (size_t)padded * sizeof *c->own);
    c->n = padded;
}

/* Units in which floats neither overflow nor vanish: the centre, the geometric mean of the distances
 * from it (one escaper does not move that), the largest mass. */
static void direct_scale(struct direct_engine *e, const struct direct_rows *rows)
{
    double sum[3] = {0}, logs = 0;
    int64_t counted = 0;
    e->mass = 0;
    for (int64_t i = 0; i < rows->n; i++) {
        for (int k = 0; k < 3; k++) sum[k] += rows->pos[i][k];
        e->mass = fmax(e->mass, rows->mass[i]);
    }
    for (int k = 0; k < 3; k++) e->centre[k] = sum[k] / (double)rows->n;
    for (int64_t i = 0; i < rows->n; i++) {
        double r2 = 0;
        for (int k = 0; k < 3; k++) r2 += pow(rows->pos[i][k] - e->centre[k], 2);
        if (r2 > 0) logs += 0.5 * log(r2), counted++;
    }
    e->scale = counted > 0 ? exp(logs / (double)counted) : 1;
    if (e->mass <= 0) e->mass = 1;
}

void direct_engine_sources(struct direct_engine *e, const struct direct_rows *sources)
{
    int padded = (int)((sources->n + TILE - 1) / TILE * TILE);
    if (sources->n > 0) direct_scale(e, sources);
    direct_send(e, &e->source, sources, 0, (int)sources->n, padded);
}

/* Blocks as large as still leave four to each of an H100's 132 multiprocessors. */
static int direct_threads(const struct direct_engine *e, int n, int count, int chunks)
{
    int threads = 128;
    while (threads > 32 && (int64_t)n * chunks < (int64_t)4 * 132 * threads * count) threads /= 2;
    return e->threads ? e->threads : threads;
}

/* The targets that are on the device, n of them. */
static void direct_run(struct direct_engine *e, int n)
{
    int chunks = (e->source.n + CHUNK - 1) / CHUNK, many = n >= 4096, count = many ? MANY : 1;
    size_t bytes = (size_t)chunks * (size_t)n * sizeof *e->part;
    if (bytes > e->part_bytes) {
        device_free(e->device, e->part);
        e->part = (struct direct_sum *)device_alloc(e->device, "direct", bytes);
        e->part_bytes = bytes;
    }
    int threads = direct_threads(e, n, count, chunks), row = threads * count;
    device_launch(e->device, "direct_chunk", direct_kernels[many][e->precision == DIRECT_PAIR][e->form],
                  dim3((n + row - 1) / row, chunks), dim3(threads), e->target, e->source, e->part);
    device_launch(e->device, "direct_reduce", direct_reduce, dim3((n + 127) / 128), dim3(128), e->part, n, chunks);
    device_download(e->device, e->host.sum, e->part, (size_t)n * sizeof *e->part);
}

void direct_engine_sum(struct direct_engine *e, const struct direct_rows *targets, double (*acc)[3], double *pot)
{
    if (e->source.n == 0) return;
    int chunks = (e->source.n + CHUNK - 1) / CHUNK;
    int64_t batch = PART_BYTES / ((int64_t)chunks * (int64_t)sizeof *e->part);
    double pull = PAIR_PULL * e->mass / (e->scale * e->scale), depth = PAIR_DEPTH * e->mass / e->scale;
    for (int64_t from = 0; from < targets->n && device_sound(e->device); from += batch) {
        int n = (int)(targets->n - from < batch ? targets->n - from : batch);
        direct_send(e, &e->target, targets, from, n, n);
        direct_run(e, n);
        for (int i = 0; i < n && device_sound(e->device); i++) {
            acc[from + i][0] = pull * e->host.sum[i].x;
            acc[from + i][1] = pull * e->host.sum[i].y;
            acc[from + i][2] = pull * e->host.sum[i].z;
            pot[from + i] = -depth * e->host.sum[i].depth;
        }
    }
}
