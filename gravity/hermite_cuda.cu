/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sums of Hermite's schemes by CUDA: see hermite_engine.h. A block of threads holds a few targets a thread in registers,
 * loads tile after tile of a chunk's sources into shared memory, sums a tile in float and the tiles in double; where few
 * rows are active, the chunks are what fills the device. A second kernel adds the chunks in order. Formulas: pair.h, in
 * Horner's form. */
#include "device.cuh"
#include "real_device.cuh"
#include "pair.h"
#include "hermite_predict.h"
extern "C" {
#include "hermite_engine.h"
#include "mem.h"
}

enum { TILE = 128, CHUNKS = 512, PART_BYTES = 1 << 28, COLUMNS_MAX = 3 * (2 + 4) + 2, QUADS = 5 };

/* Predicted rows, four floats at a time: leading parts of the position and the mass; trailing parts and the softening;
 * velocity; acceleration; jerk. */
struct hermite_quads { float4 *quad[QUADS]; };

struct hermite_engine {
    struct device *device;
    int p, threads;
    bool bare;
    struct hermite_units units;
    int n, padded;              /* rows; whole tiles */
    double *state;              /* column c of row i at [c * padded + i] */
    int64_t *began;
    struct hermite_quads rows;
    int32_t *place;             /* of rows that are put, or of targets */
    double *packed, *part;
    int64_t *packed_began;
    int place_room, packed_room;
    size_t part_bytes;
};

/* --- states and prediction --- */

/* n rows as they come, to their places. */
struct hermite_packed { const double *state; const int64_t *began; const int32_t *place; int n, width; };

static __global__ void hermite_put_rows(double *state, int64_t *began, int padded, struct hermite_packed from)
{
    const int i = (int)(blockIdx.x * blockDim.x + threadIdx.x), c = (int)blockIdx.y;
    if (i >= from.n) return;
    if (c < from.width) state[(size_t)c * padded + from.place[i]] = from.state[(size_t)c * from.n + i];
    else began[from.place[i]] = from.began[i];
}

struct hermite_stage {
    const double *state;
    const int64_t *began;
    int n, padded;
    struct hermite_now now;
    struct hermite_units units;
};

/* Rows from n on have no mass. */
template <int p> static __global__ void hermite_predict(struct hermite_stage s, struct hermite_quads to, int derivatives)
{
    enum { KEPT = 2 * p - 2 };
    const int i = (int)(blockIdx.x * blockDim.x + threadIdx.x);
    if (i >= s.padded) return;
    float out[QUADS][3] = {{0}};
    const double length = 1 / s.units.length, velocity = 1 / s.units.velocity, rate = s.units.length / s.units.velocity;
    const double t = i < s.n ? (double)(s.now.tick - s.began[i]) * s.now.tick_length : 0;
#pragma unroll
    for (int k = 0; k < 3 && i < s.n; k++) {
        double d[2 + KEPT];
#pragma unroll
        for (int c = 0; c < 2 + KEPT; c++) d[c] = s.state[(size_t)(3 * c + k) * s.padded + i];
        const double x = hermite_taylor(d, 2 + KEPT, t) * length;
        out[0][k] = (float)x;
        out[1][k] = (float)(x - (double)out[0][k]);
        out[2][k] = (float)((hermite_taylor(d + 1, 1 + KEPT, t) - s.units.bulk[k]) * velocity);
        out[3][k] = (float)(hermite_taylor(d + 2, KEPT, t) * velocity * rate);
        out[4][k] = (float)(hermite_taylor(d + 3, KEPT - 1, t) * velocity * rate * rate);
    }
    const int at = 3 * (2 + KEPT);
    const float mass = i < s.n ? (float)(s.state[(size_t)at * s.padded + i] * velocity * velocity * length) : 0.f;
    const float soft = i < s.n ? (float)(s.state[(size_t)(at + 1) * s.padded + i] * length * length) : 1.f;
#pragma unroll
    for (int q = 0; q < QUADS; q++)
        if (q <= derivatives)
            to.quad[q][i] = make_float4(out[q][0], out[q][1], out[q][2], q == 0 ? mass : q == 1 ? soft : 0.f);
}

/* --- pairs --- */

/* Rounded; its cube is taken out of the sums as it is. */
static constexpr float root3 = (float)PAIR_ROOT3;

/* A row in registers; sums of the derivatives of its acceleration over a tile. */
struct hermite_target { float high[3], low[3], vel[3], acc[3], jerk[3], soft, sum[4][3]; };

DEVICE void hermite_axes(float to[3], float4 from)
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

template <int derivatives, bool bare>
DEVICE void hermite_add(struct hermite_target *t, const float4 q[derivatives + 1])
{
    float high[3], low[3], vel[3], acc[3] = {0}, jerk[3] = {0}, r[3], v[3], a[3], c[3], second = 0, third = 0;
    hermite_axes(high, q[0]);
    hermite_axes(low, q[1]);
    hermite_axes(vel, q[2]);
    if (derivatives > 2) hermite_axes(acc, q[derivatives > 2 ? 3 : 0]);
    if (derivatives > 3) hermite_axes(jerk, q[derivatives > 3 ? 4 : 0]);
#pragma unroll
    for (int k = 0; k < 3; k++) {
        r[k] = (high[k] - t->high[k]) + (low[k] - t->low[k]);
        v[k] = vel[k] - t->vel[k];
        if (derivatives > 2) a[k] = acc[k] - t->acc[k];
        if (derivatives > 3) c[k] = jerk[k] - t->jerk[k];
    }
    float mass = q[0].w, r2 = q[1].w + t->soft + r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    if (bare) {
        mass = real_if_less(0.f, r2, mass, 0.f);
        r2 = real_max(r2, REAL_FLOOR);
    }
    const float rv = r[0] * v[0] + r[1] * v[1] + r[2] * v[2];
    if (derivatives > 2) second = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + r[0] * a[0] + r[1] * a[1] + r[2] * a[2];
    if (derivatives > 3)
        third = 3 * (v[0] * a[0] + v[1] * a[1] + v[2] * a[2]) + r[0] * c[0] + r[1] * c[1] + r[2] * c[2];
    const float y = root3 * real_rsqrt_guess(r2);
    const struct pair_rates p = pair_rates(derivatives, y, mass, rv, second, third);
    /* Fused by hand: the compiler leaves differences of products apart. */
    const float alpha6 = 2 * p.alpha3, alpha9 = 3 * p.alpha3, beta = derivatives > 2 ? p.beta3 : 0;
#pragma unroll
    for (int k = 0; k < 3; k++) {
        const float j = real_fma(-p.alpha3, r[k], v[k]);
        t->sum[0][k] += p.pull * r[k];
        t->sum[1][k] += p.pull * j;
        if (derivatives < 3) continue;
        const float s = real_fma(-alpha6, j, real_fma(-beta, r[k], a[k]));
        t->sum[2][k] += p.pull * s;
        if (derivatives < 4) continue;
        t->sum[3][k] += p.pull * real_fma(-alpha9, s, real_fma(-3 * beta, j, real_fma(-p.gamma3, r[k], c[k])));
    }
}

template <int derivatives> DEVICE void hermite_load(struct hermite_target *t, const struct hermite_quads &rows, int i)
{
    hermite_axes(t->high, rows.quad[0][i]);
    hermite_axes(t->low, rows.quad[1][i]);
    hermite_axes(t->vel, rows.quad[2][i]);
    if (derivatives > 2) hermite_axes(t->acc, rows.quad[3][i]);
    if (derivatives > 3) hermite_axes(t->jerk, rows.quad[4][i]);
    t->soft = rows.quad[1][i].w;
}

/* Block (b, c): targets b * count * threads and on, from the `tiles` tiles of chunk c. */
template <int count, int derivatives, bool bare>
static __global__ void __launch_bounds__(128, count > 2 ? 3 : 4)
hermite_chunk(struct hermite_quads rows, int padded, const int32_t *target, int targets, int tiles, double *part)
{
    __shared__ float4 tile[TILE][derivatives + 1];
    struct hermite_target t[count];
    double sum[count][3 * derivatives] = {{0}};
    const int thread = (int)threadIdx.x, threads = (int)blockDim.x, first = (int)blockIdx.x * threads * count + thread;
#pragma unroll
    for (int k = 0; k < count; k++) hermite_load<derivatives>(&t[k], rows, target[min(first + k * threads, targets - 1)]);
    const int from = (int)blockIdx.y * tiles * TILE, to = min(from + tiles * TILE, padded);
    for (int at = from; at < to; at += TILE) {
        __syncthreads();
        for (int j = thread; j < TILE; j += threads)
#pragma unroll
            for (int q = 0; q <= derivatives; q++) tile[j][q] = rows.quad[q][at + j];
        __syncthreads();
#pragma unroll
        for (int k = 0; k < count; k++)
            for (int w = 0; w < 3 * derivatives; w++) t[k].sum[w / 3][w % 3] = 0.f;
#pragma unroll 2
        for (int j = 0; j < TILE; j++)
#pragma unroll
            for (int k = 0; k < count; k++) hermite_add<derivatives, bare>(&t[k], tile[j]);
#pragma unroll
        for (int k = 0; k < count; k++)
            for (int w = 0; w < 3 * derivatives; w++) sum[k][w] += (double)t[k].sum[w / 3][w % 3];
    }
#pragma unroll
    for (int k = 0; k < count; k++) {
        const int i = first + k * threads;
        for (int w = 0; w < 3 * derivatives && i < targets; w++)
            part[((size_t)blockIdx.y * targets + i) * (3 * derivatives) + w] = sum[k][w];
    }
}

/* Adds the chunks of every number in order, into the first. */
static __global__ void hermite_reduce(double *part, int numbers, int chunks)
{
    const int i = (int)(blockIdx.x * blockDim.x + threadIdx.x);
    if (i >= numbers) return;
    double sum = part[i];
    for (int c = 1; c < chunks; c++) sum += part[(size_t)c * numbers + i];
    part[i] = sum;
}

/* --- the engine --- */

typedef void hermite_kernel(struct hermite_quads, int, const int32_t *, int, int, double *);

/* By derivatives - 2, bare, and few or many targets: several a thread share what is read of a tile. */
struct hermite_choice { hermite_kernel *kernel[2]; int count[2]; };
#define CHOICE(derivatives, bare, many) \
    { { hermite_chunk<1, derivatives, bare>, hermite_chunk<many, derivatives, bare> }, { 1, many } }
static const struct hermite_choice hermite_choices[3][2] = {{CHOICE(2, false, 4), CHOICE(2, true, 4)},
                                                            {CHOICE(3, false, 2), CHOICE(3, true, 2)},
                                                            {CHOICE(4, false, 1), CHOICE(4, true, 1)}};
#undef CHOICE

struct hermite_engine *hermite_engine_create(struct device *device, int p, bool bare, int threads)
{
    struct hermite_engine *e = (struct hermite_engine *)mem_alloc("hermite", sizeof *e);
    e->device = device;
    e->p = p;
    e->bare = bare;
    e->threads = threads;
    return e;
}

int hermite_engine_width(const struct hermite_engine *e) { return 3 * (2 + hermite_kept(e->p)) + 2; }

static void hermite_release_rows(struct hermite_engine *e)
{
    device_free(e->device, e->state);
    device_free(e->device, e->began);
    for (int q = 0; q < QUADS; q++) device_free(e->device, e->rows.quad[q]);
}

void hermite_engine_free(struct hermite_engine *e)
{
    if (!e) return;
    hermite_release_rows(e);
    device_free(e->device, e->place);
    device_free(e->device, e->packed);
    device_free(e->device, e->packed_began);
    device_free(e->device, e->part);
    mem_free(e);
}

void hermite_engine_rows(struct hermite_engine *e, int64_t n, const struct hermite_units *units)
{
    const int padded = (int)((n + TILE - 1) / TILE * TILE);
    e->units = *units;
    e->n = (int)n;
    if (padded == e->padded) return;
    hermite_release_rows(e);
    e->padded = padded;
    e->state = (double *)device_alloc(e->device, "hermite", (size_t)hermite_engine_width(e) * padded * sizeof *e->state);
    e->began = (int64_t *)device_alloc(e->device, "hermite", (size_t)padded * sizeof *e->began);
    for (int q = 0; q < QUADS; q++)
        e->rows.quad[q] = (float4 *)device_alloc(e->device, "hermite", (size_t)padded * sizeof(float4));
}

static void hermite_place(struct hermite_engine *e, const int32_t *place, int n)
{
    if (n > e->place_room) {
        device_free(e->device, e->place);
        e->place = (int32_t *)device_alloc(e->device, "hermite", (size_t)n * sizeof *e->place);
        e->place_room = n;
    }
    device_upload(e->device, e->place, place, (size_t)n * sizeof *e->place);
}

void hermite_engine_put(struct hermite_engine *e, const struct hermite_states *s)
{
    const int n = (int)s->n, width = hermite_engine_width(e);
    if (n == 0) return;
    hermite_place(e, s->place, n);
    if (n > e->packed_room) {
        device_free(e->device, e->packed);
        device_free(e->device, e->packed_began);
        e->packed = (double *)device_alloc(e->device, "hermite", (size_t)n * width * sizeof *e->packed);
        e->packed_began = (int64_t *)device_alloc(e->device, "hermite", (size_t)n * sizeof *e->packed_began);
        e->packed_room = n;
    }
    device_upload(e->device, e->packed, s->state, (size_t)n * width * sizeof *e->packed);
    device_upload(e->device, e->packed_began, s->began, (size_t)n * sizeof *e->packed_began);
    const struct hermite_packed packed = {e->packed, e->packed_began, e->place, n, width};
    device_launch(e->device, "hermite_put_rows", hermite_put_rows, dim3((n + 127) / 128, width + 1), dim3(128), e->state, e->began,
                  e->padded, packed);
}

static void hermite_stage_rows(struct hermite_engine *e, const struct hermite_now *now, int derivatives)
{
    const struct hermite_stage stage = {e->state, e->began, e->n, e->padded, *now, e->units};
    device_launch(e->device, "hermite_predict", e->p == 2 ? hermite_predict<2> : hermite_predict<3>, dim3((e->padded + 127) / 128),
                  dim3(128), stage, e->rows, derivatives);
}

/* Blocks as large as still leave four to each of an H100's 132 multiprocessors. */
static int hermite_threads(const struct hermite_engine *e, int n, int count, int chunks)
{
    int threads = 128;
    while (threads > 32 && (int64_t)n * chunks < (int64_t)4 * 132 * threads * count) threads /= 2;
    return e->threads ? e->threads : threads;
}

/* n targets; tiles of a chunk. */
static void hermite_run(struct hermite_engine *e, int derivatives, int n, int tiles, double *sum)
{
    const int chunks = (e->padded / TILE + tiles - 1) / tiles, numbers = 3 * derivatives * n, many = n >= 4096;
    const struct hermite_choice *choice = &hermite_choices[derivatives - 2][e->bare];
    const size_t bytes = (size_t)chunks * numbers * sizeof *e->part;
    if (bytes > e->part_bytes) {
        device_free(e->device, e->part);
        e->part = (double *)device_alloc(e->device, "hermite", bytes);
        e->part_bytes = bytes;
    }
    const int threads = hermite_threads(e, n, choice->count[many], chunks), row = threads * choice->count[many];
    device_launch(e->device, "hermite_chunk", choice->kernel[many], dim3((n + row - 1) / row, chunks), dim3(threads), e->rows,
                  e->padded, e->place, n, tiles, e->part);
    device_launch(e->device, "hermite_reduce", hermite_reduce, dim3((numbers + 127) / 128), dim3(128), e->part, numbers, chunks);
    device_download(e->device, sum, e->part, (size_t)numbers * sizeof *sum);
}

void hermite_engine_sum(struct hermite_engine *e, const struct hermite_now *now, int derivatives, const int32_t *target,
                        int64_t n, double *sum)
{
    const int tiles = (e->padded / TILE + CHUNKS - 1) / CHUNKS, width = 3 * derivatives;
    const int chunks = tiles ? (e->padded / TILE + tiles - 1) / tiles : 0;
    if (n == 0) return;
    hermite_stage_rows(e, now, derivatives);
    const int64_t batch = PART_BYTES / ((int64_t)chunks * width * (int64_t)sizeof *e->part);
    const double root = (double)root3;
    double unit[4] = {e->units.velocity * e->units.velocity / e->units.length / (root * root * root)};
    for (int d = 1; d < derivatives; d++) unit[d] = unit[d - 1] * e->units.velocity / e->units.length;
    for (int64_t from = 0; from < n && device_sound(e->device); from += batch) {
        const int some = (int)(n - from < batch ? n - from : batch);
        hermite_place(e, target + from, some);
        hermite_run(e, derivatives, some, tiles, sum + from * width);
        for (int64_t i = 0; i < (int64_t)some * width && device_sound(e->device); i++)
            sum[from * width + i] *= unit[i % width / 3];
    }
}
