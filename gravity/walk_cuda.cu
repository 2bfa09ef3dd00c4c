/* SPDX-License-Identifier: GPL-3.0-or-later
 * The grouped walk by CUDA: a warp for a group of target rows (Bedorf, Gaburov & Portegies Zwart 2012).
 *
 * A turn (warp.cuh) judges up to 32 cells: one far away goes to a list, the rows of a leaf go to a tile, a
 * cell to be opened goes on the stack. Lists and tiles are in shared memory, in floats about the group's
 * centre (the double difference is taken once an entry); full ones act on the targets at once. Sums over a
 * list or tile are floats, those over all of them doubles.
 *
 * By an error (solver fmm) a group walks twice: expand_cuda.cu has summed the cells that go into its local expansion, and
 * what is left, cells and rows on rows, is added here.
 *
 * Lanes carry one or two targets. Where a group has 16 or fewer, several lanes share one: each takes
 * every second, fourth ... source, and the parts are added at the end in one order. */
#include "walk.cuh"
#include "cell.h"
#include "pair.h"
extern "C" {
#include "mem.h"
}

enum { WARPS_MAX = 4, TILE = 128, ROOM = TILE + LANES, FAR = 2 * LANES };

/* A cell that acts, in the unit of the group. */
struct __align__(16) walk_cell { float4 place; struct cell_quadrupole moment; };

/* What a warp keeps in shared memory. */
struct __align__(16) walk_memory {
    float4 row[ROOM];       /* about the group's centre, in the unit of pairs */
    float soft[ROOM];
    int32_t index[ROOM];    /* of the row, in the order of the keys */
    struct walk_cell cell[LANES];
    int32_t far[FAR];       /* cells that will act */
    struct warp_stack stack;
};

/* A warp at work: the same in all lanes but for lane, slot and part. */
struct walk_warp {
    struct walk_memory *memory;
    struct walk_eye eye;
    int lane, slot, part, parts;    /* this lane's target (and slot + 32), and which of the sources it takes */
    int depth, rows, far;           /* entries in use */
    int own_from, own_to;           /* rows of the group */
    bool own;                       /* the tile may hold rows of the group */
    float length;                   /* the unit of pairs in that of the group */
    float soft2;                    /* of pairs, where it is common */
    unsigned cells, pairs;          /* that have acted */
};

struct walk_sums { float x, y, z, depth; };
struct walk_row { float x, y, z, soft; int32_t index; double sum[4]; };

template <int count>
DEVICE void walk_promote(struct walk_row *t, const struct walk_sums *s, float area, float length)
{
#pragma unroll
    for (int k = 0; k < count; k++) {
        t[k].sum[0] += (double)(area * s[k].x);
        t[k].sum[1] += (double)(area * s[k].y);
        t[k].sum[2] += (double)(area * s[k].z);
        t[k].sum[3] += (double)(length * s[k].depth);
    }
}

/* One row of the tile on the targets of a lane. */
template <softening_form form, int count, bool own>
DEVICE void walk_pair(struct walk_sums *s, const struct walk_row *t, const struct walk_warp *w, int j)
{
    const float4 row = w->memory->row[j];
#pragma unroll
    for (int k = 0; k < count; k++) {
        float dx = row.x - t[k].x, dy = row.y - t[k].y, dz = row.z - t[k].z;
        /* A softening that all rows share starts the sum of squares instead of being added to it. */
        struct pair p = form == SOFT_COMMON ? pair_newton(w->soft2 + dx * dx + dy * dy + dz * dz, row.w)
                                            : pair_any(form, dx * dx + dy * dy + dz * dz, row.w, w->memory->soft[j] + t[k].soft);
        s[k].x += p.pull * dx;
        s[k].y += p.pull * dy;
        s[k].z += p.pull * dz;
        s[k].depth += own && w->memory->index[j] == t[k].index ? 0.f : p.depth;
    }
}

/* The first n rows of the tile act. */
template <softening_form form, int count>
DEVICE void walk_rows_act(struct walk_warp *w, struct walk_row *t, int n)
{
    const int first = count > 1 ? 0 : w->part, step = count > 1 ? 1 : w->parts;     /* literals where lanes have two targets */
    struct walk_sums s[count] = {};
    __syncwarp();
    if (w->own) {
        for (int j = first; j < n; j += step) walk_pair<form, count, true>(s, t, w, j);
    } else {
#pragma unroll 4
        for (int j = first; j < n; j += step) walk_pair<form, count, false>(s, t, w, j);
    }
    walk_promote<count>(t, s, 1.f, 1.f);
    w->pairs += n;
    __syncwarp();
}

/* What is left of a tile that has acted moves to its front. */
DEVICE void walk_keep_rest(struct walk_warp *w)
{
    struct walk_memory *m = w->memory;
    w->rows -= TILE;
    if (w->lane < w->rows) {
        m->row[w->lane] = m->row[TILE + w->lane];
        m->soft[w->lane] = m->soft[TILE + w->lane];
        m->index[w->lane] = m->index[TILE + w->lane];
    }
    __syncwarp();
}

/* The rows of a leaf go to the tile, which acts when it is full. */
template <softening_form form, int count>
DEVICE void walk_add_leaf(struct walk_warp *w, struct walk_row *t, const struct walk_field *f,
                                                     int32_t n)
{
    struct walk_memory *m = w->memory;
    const struct gravity_leaf leaf = f->leaf[n];
    const double *pos = f->cell[n].pos;
    const float x = (float)((pos[0] - w->eye.centre[0]) * f->unit1), y = (float)((pos[1] - w->eye.centre[1]) * f->unit1),
                z = (float)((pos[2] - w->eye.centre[2]) * f->unit1);
    const bool own = leaf.first >= w->own_from && leaf.first < w->own_to;
    for (int from = 0; from < leaf.n; from += LANES) {
        int i = leaf.first + from + w->lane, at = w->rows + w->lane;
        if (from + w->lane < leaf.n) {
            float4 row = f->row[i];
            m->row[at] = make_float4(row.x + x, row.y + y, row.z + z, row.w);
            if (form != SOFT_COMMON) m->soft[at] = f->soft[i];
            m->index[at] = i;
        }
        w->rows += min(leaf.n - from, (int)LANES);
        w->own = w->own || own;
        if (w->rows < TILE) continue;
        walk_rows_act<form, count>(w, t, TILE);
        walk_keep_rest(w);
        w->own = own;
    }
}

/* The first n cells of the list act, 32 at most. */
template <int count, bool quadrupole>
DEVICE void walk_cells_act(struct walk_warp *w, struct walk_row *t, const struct walk_field *f, int n)
{
    struct walk_memory *m = w->memory;
    const float soft2 = (float)(f->far_soft2 * w->eye.unit1 * w->eye.unit1), length = w->length;
    __syncwarp();
    if (w->lane < n) {
        const struct gravity_cell *cell = &f->cell[m->far[w->lane]];
        const float unit = cell->scale * (float)w->eye.unit1, unit2 = unit * unit;
        const float *q = f->moment + (int64_t)f->width * m->far[w->lane];
        struct walk_cell *to = &m->cell[w->lane];
        to->place = make_float4((float)((cell->pos[0] - w->eye.centre[0]) * w->eye.unit1),
                                (float)((cell->pos[1] - w->eye.centre[1]) * w->eye.unit1),
                                (float)((cell->pos[2] - w->eye.centre[2]) * w->eye.unit1), cell->mass);
        if (quadrupole) to->moment = (struct cell_quadrupole){unit2 * q[0], unit2 * q[1], unit2 * q[2],
                                                              unit2 * q[3], unit2 * q[4], unit2 * q[5]};
    }
    __syncwarp();
    const int first = count > 1 ? 0 : w->part, step = count > 1 ? 1 : w->parts;
    struct walk_sums s[count] = {};
    for (int j = first; j < n; j += step) {
        const struct walk_cell cell = m->cell[j];
#pragma unroll
        for (int k = 0; k < count; k++) {
            struct cell_vector r = {length * t[k].x - cell.place.x, length * t[k].y - cell.place.y,
                                    length * t[k].z - cell.place.z};
            struct cell_field a = cell_field(r, cell.place.w, cell.moment, soft2, quadrupole);
            s[k].x += a.x;
            s[k].y += a.y;
            s[k].z += a.z;
            s[k].depth += a.depth;
        }
    }
    walk_promote<count>(t, s, length * length, length);
    w->cells += n;
    __syncwarp();
}

/* One turn: `n` of each lane is judged, a cell or, with NO_LOCAL, one that goes into no expansion. */
template <softening_form form, enum walk_rule rule, int count>
DEVICE void walk_turn(struct walk_warp *w, struct walk_row *t, const struct walk_field *f, int32_t n)
{
    struct walk_memory *m = w->memory;
    const bool here = n >= 0, no_local = here && (n & NO_LOCAL);
    n = here ? n & ~NO_LOCAL : 0;
    const struct gravity_cell *cell = &f->cell[n];
    const int verdict = !here ? GRAVITY_LOCAL : rule == BY_ERROR ? walk_by_error(&w->eye, cell, f->order, no_local)
                                                                 : walk_by_angle(&w->eye, cell);
    const bool far = verdict == GRAVITY_FAR, near = verdict == GRAVITY_NEAR,
               open = verdict == GRAVITY_OPEN || verdict == GRAVITY_OPEN_FAR;
    warp_push(&m->stack, &w->depth, w->lane, open, verdict == GRAVITY_OPEN_FAR ? cell->child | NO_LOCAL : cell->child,
              cell->n_children);
    int place = warp_place(w->lane, far, &w->far);
    if (far) m->far[place] = n;
    if (w->far >= LANES) {
        walk_cells_act<count, rule != MONOPOLES>(w, t, f, LANES);
        w->far -= LANES;
        if (w->lane < w->far) m->far[w->lane] = m->far[LANES + w->lane];
    }
    for (unsigned left = __ballot_sync(~0u, near); left != 0; left &= left - 1)
        walk_add_leaf<form, count>(w, t, f, __shfl_sync(~0u, n, __ffs((int)left) - 1));
    __syncwarp();
}

/* Up to 32 targets times `count`, from `from` on. */
template <softening_form form, enum walk_rule rule, int count>
DEVICE void walk_targets(struct walk_warp *w, const struct walk_field *f,
                                                    const struct walk_wanted *wanted, int from, int n)
{
    struct walk_row t[count];
    w->parts = warp_parts(n);
    const int slots = LANES / w->parts;
    w->slot = w->lane % slots;
    w->part = w->lane / slots;
#pragma unroll
    for (int k = 0; k < count; k++) {
        const struct walk_target target = wanted->target[from + min(w->slot + k * LANES, n - 1)];
        const float4 row = f->row[target.row];
        const double *pos = f->cell[target.leaf].pos;
        t[k].x = row.x + (float)((pos[0] - w->eye.centre[0]) * f->unit1);
        t[k].y = row.y + (float)((pos[1] - w->eye.centre[1]) * f->unit1);
        t[k].z = row.z + (float)((pos[2] - w->eye.centre[2]) * f->unit1);
        t[k].soft = form == SOFT_COMMON ? 0.f : f->soft[target.row];
        t[k].index = target.row;
        for (int c = 0; c < 4; c++) t[k].sum[c] = 0;
    }
    w->depth = w->rows = w->far = 0;
    w->own = false;
    walk_turn<form, rule, count>(w, t, f, w->lane == 0 ? 0 : -1);
    while (w->depth > 0) walk_turn<form, rule, count>(w, t, f, warp_pop(&w->memory->stack, &w->depth, w->lane));
    if (w->far > 0) walk_cells_act<count, rule != MONOPOLES>(w, t, f, w->far);
    if (w->rows > 0) walk_rows_act<form, count>(w, t, w->rows);
    for (int lanes = slots; lanes < LANES; lanes *= 2)
        for (int c = 0; c < 4; c++) t[0].sum[c] += __shfl_xor_sync(~0u, t[0].sum[c], lanes);
    const double area1 = f->unit1 * f->unit1;
#pragma unroll
    for (int k = 0; k < count; k++) {
        if (w->part > 0 || w->slot + k * LANES >= n) continue;
        float4 *to = &wanted->field[from + w->slot + k * LANES];
        const float4 far = rule == BY_ERROR ? *to : make_float4(0, 0, 0, 0);    /* of the local expansion */
        *to = make_float4((float)(area1 * t[k].sum[0] + far.x), (float)(area1 * t[k].sum[1] + far.y),
                          (float)(area1 * t[k].sum[2] + far.z), (float)(far.w - f->unit1 * t[k].sum[3]));
    }
}

/* A group a warp. */
template <softening_form form, enum walk_rule rule>
static __global__ void __launch_bounds__(LANES * WARPS_MAX, 4) walk_group(struct walk_field f, struct walk_wanted wanted)
{
    __shared__ struct walk_memory memory[WARPS_MAX];
    const int warp = (int)(threadIdx.x / LANES), group = (int)(blockIdx.x * (blockDim.x / LANES)) + warp;
    if (group >= wanted.n) return;
    struct walk_warp w = {};
    w.memory = &memory[warp];
    w.eye = walk_eye_of(&wanted.view[group]);
    w.lane = (int)(threadIdx.x % LANES);
    w.length = (float)(w.eye.unit1 / f.unit1);
    w.soft2 = (float)(f.far_soft2 * f.unit1 * f.unit1);
    w.own_from = f.leaf[w.eye.view->cell].first;
    w.own_to = w.own_from + f.leaf[w.eye.view->cell].n;
    const int end = wanted.first[group + 1];
    unsigned long long cells = 0, pairs = 0;
    for (int from = wanted.first[group]; from < end; from += WALK_GROUP) {
        const int n = min(end - from, (int)WALK_GROUP);
        w.cells = w.pairs = 0;
        if (n > LANES) walk_targets<form, rule, 2>(&w, &f, &wanted, from, n);
        else walk_targets<form, rule, 1>(&w, &f, &wanted, from, n);
        cells += (unsigned long long)w.cells * (unsigned)n;
        pairs += (unsigned long long)w.pairs * (unsigned)n;
    }
    if (w.lane > 0) return;
    atomicAdd(&wanted.counts[0], cells);
    atomicAdd(&wanted.counts[1], pairs);
}

/* By form and rule. */
#define WALK_FORM(form) {walk_group<form, MONOPOLES>, walk_group<form, QUADRUPOLES>, walk_group<form, BY_ERROR>}
static walk_kernel *const walk_kernels[3][3] = {WALK_FORM(SOFT_COMMON), WALK_FORM(SOFT_PLUMMER), WALK_FORM(SOFT_SPLINE)};

/* A block of the device that grows with what it is to hold. */
struct walk_block { void *at; size_t bytes; };
enum walk_column { CELL, LEAF, MOMENT, ROW, SOFT, VIEW, FIRST, TARGET, FIELD, COUNTS, COLUMNS };

struct walk_engine {
    struct device *device;
    int form, warps;
    struct walk_block block[COLUMNS];
    struct walk_field field;
};

struct walk_engine *walk_engine_create(struct device *device, int warps)
{
    struct walk_engine *e = (struct walk_engine *)mem_alloc("gravity", sizeof *e);
    e->device = device;
    e->warps = warps ? warps : WARPS_MAX;
    return e;
}

void walk_engine_free(struct walk_engine *e)
{
    if (!e) return;
    for (int c = 0; c < COLUMNS; c++) device_free(e->device, e->block[c].at);
    mem_free(e);
}

static void *walk_reserve(struct walk_engine *e, enum walk_column column, size_t bytes)
{
    struct walk_block *block = &e->block[column];
    if (bytes <= block->bytes) return block->at;
    device_free(e->device, block->at);
    /* A little more than asked: the next tree is similar, and giving memory back waits for the device. */
    block->bytes = bytes + bytes / 16;
    block->at = device_alloc(e->device, "tree", block->bytes);
    return block->at;
}

static void *walk_send(struct walk_engine *e, enum walk_column column, const void *from, size_t bytes)
{
    void *to = walk_reserve(e, column, bytes);
    device_upload(e->device, to, from, bytes);
    return to;
}

void walk_engine_sources(struct walk_engine *e, const struct walk_sources *s)
{
    const size_t cells = (size_t)s->n_cells, rows = (size_t)s->n_rows;
    e->form = s->form;
    e->field.order = s->order;
    e->field.cell = (const struct gravity_cell *)walk_send(e, CELL, s->cell, cells * sizeof *s->cell);
    e->field.leaf = (const struct gravity_leaf *)walk_send(e, LEAF, s->leaf, cells * sizeof *s->leaf);
    e->field.moment = (const float *)walk_send(e, MOMENT, s->moment, cells * (size_t)s->width * sizeof *s->moment);
    e->field.row = (const float4 *)walk_send(e, ROW, s->row, rows * sizeof *s->row);
    e->field.soft = (const float *)walk_send(e, SOFT, s->soft, s->soft ? rows * sizeof *s->soft : 0);
    e->field.width = s->width;
    e->field.unit1 = 1 / s->unit;
    e->field.far_soft2 = s->far_soft2;
}

void walk_engine_sum(struct walk_engine *e, const struct walk_groups *groups, float (*field)[4])
{
    const size_t n = (size_t)groups->n, targets = (size_t)groups->first[groups->n];
    const unsigned long long none[2] = {0, 0};
    if (n == 0) return;
    struct walk_wanted wanted = {};
    wanted.n = groups->n;
    wanted.view = (const struct gravity_view *)walk_send(e, VIEW, groups->view, n * sizeof *groups->view);
    wanted.first = (const int32_t *)walk_send(e, FIRST, groups->first, (n + 1) * sizeof *groups->first);
    wanted.target = (const struct walk_target *)walk_send(e, TARGET, groups->target, targets * sizeof *groups->target);
    wanted.field = (float4 *)walk_reserve(e, FIELD, targets * sizeof *wanted.field);
    wanted.counts = (unsigned long long *)walk_send(e, COUNTS, none, sizeof none);
    const enum walk_rule rule = e->field.order > 2 ? BY_ERROR : e->field.order == 2 ? QUADRUPOLES : MONOPOLES;
    if (rule == BY_ERROR)
        device_launch(e->device, "walk_expand", walk_expand_kernel(e->field.order), dim3((unsigned)groups->n), dim3(LANES),
                      e->field, wanted);
    device_launch(e->device, "walk_group", walk_kernels[e->form][rule],
                  dim3((unsigned)((groups->n + e->warps - 1) / e->warps)), dim3((unsigned)(LANES * e->warps)), e->field, wanted);
    device_download(e->device, field, wanted.field, targets * sizeof *field);
}

struct walk_counts walk_engine_counts(struct walk_engine *e)
{
    unsigned long long counts[2] = {0, 0};
    device_download(e->device, counts, e->block[COUNTS].at, sizeof counts);
    struct walk_counts result = {(int64_t)counts[0], (int64_t)counts[1]};
    return result;
}
