/* SPDX-License-Identifier: GPL-3.0-or-later
 * The acceleration and its derivatives for Hermite's schemes, summed over all rows, which are predicted to now.
 *
 * Sources are cut into chunks and these into segments, both by the number of rows alone. A chunk's sum, a segment's sum of
 * its chunks in order, the sum of the segments in order: the same bits on any number of threads and ranks, whoever sums
 * what. Several ranks either share out the targets, each with all sources, or the sources, each with all targets (the
 * j-parallel scheme of phi-GRAPE: Harfst et al. 2007, New Astronomy 12, 357), whichever is less work for the busiest. */
#include "comm.h"
#include "hermite.h"
#include "mem.h"
#include <math.h>
#include <string.h>

/* Sources of a partial sum: as many as lie in the nearest cache while a turn of targets goes over them (with 2048, floats
 * are 1.3 to 2 times slower: tests/bench_gravity.c). Targets of one thread's turn. Sums over segments kept at a time. */
enum { CHUNK = 512, TURN = 16, SEGMENTS = 32, PARTS = 1 << 18 };
/* Pairs that cost as much as the prediction of a row. */
enum { PREDICTION = 16 };
/* Of a sum of pairs in floats, relative: rms 3e-8 (doc/manual/hermite.md), but more where the pulls of others cancel. */
static const double float_noise = 3e-7;

/* --- rows --- */

/* Powers of two, so that nothing is rounded, by which the powers that the derivatives hold stay within floats: lengths
 * from 1e-10 to 1e3 of the set and their powers -9. A few far rows shall not count: the mean is of logarithms. */
enum { BELOW = 10 };     /* bits that the unit of length is below the mean distance */

static void choose_units(const struct sim *sim, struct hermite *h)
{
    double sum = 0, mass = 0, n = 0, centre[3] = {0};
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            mass += s->mass[i];
            for (int k = 0; k < 3; k++) {
                centre[k] += s->mass[i] * s->pos[i][k];
                h->units.bulk[k] += s->mass[i] * s->vel[i][k];
            }
        }
    for (int k = 0; k < 3 && mass > 0; k++) {
        centre[k] /= mass;
        h->units.bulk[k] /= mass;
    }
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            double r2 = 0;
            for (int k = 0; k < 3; k++) r2 += (s->pos[i][k] - centre[k]) * (s->pos[i][k] - centre[k]);
            if (!(r2 > 0)) continue;
            sum += 0.5 * log(r2);
            n++;
        }
    const double size = n > 0 ? exp(sum / n) : 1, velocity2 = h->gravity->G * mass / size;
    h->units.length = ldexp(1, (int)floor(log2(size)) - BELOW);
    h->units.velocity = velocity2 > 0 ? ldexp(1, (int)floor(0.5 * log2(velocity2))) : 1;
}

/* By up to 8 times more, as the units are powers of two below. */
double hermite_mean_pull(const struct hermite *h)
{
    return ldexp(4 * h->units.velocity * h->units.velocity / h->units.length, -BELOW);
}

static void make_float_room(struct hermite *h)
{
    enum { COLUMNS = 14 };
    h->float_room = mem_resize("hermite", h->float_room, (size_t)(COLUMNS * h->capacity) * sizeof(float));
    float **const column[] = {h->floats.high, h->floats.low, h->floats.vel, h->floats.acc};
    for (int c = 0; c < COLUMNS; c++)
        for (int64_t i = h->rows.n; i < h->capacity; i++) h->float_room[c * h->capacity + i] = c == COLUMNS - 1;
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < 3; k++) column[c][k] = h->float_room + (3 * c + k) * h->capacity;
    h->floats.mass = h->float_room + (COLUMNS - 2) * h->capacity;
    h->floats.soft = h->float_room + (COLUMNS - 1) * h->capacity;
}

void hermite_make_room(const struct sim *sim, struct hermite *h)
{
    enum { COLUMNS = 14, PAD = GRAVITY_LANES_MAX };
    int64_t n = 0, active = 0;
    for_species(sim, s) {
        h->base[s->kind] = n;
        n += s->n;
        active += s->n_active;
    }
    h->rows.n = n;
    if (n > h->capacity) {
        h->capacity = (n + PAD - 1) / PAD * PAD;
        h->room = mem_resize("hermite", h->room, (size_t)(COLUMNS * h->capacity) * sizeof(double));
        double *at = h->room;
        for (int k = 0; k < 3; k++, at += 4 * h->capacity) {
            h->rows.pos[k] = at;
            h->rows.vel[k] = at + h->capacity;
            h->rows.acc[k] = at + 2 * h->capacity;
            h->rows.jerk[k] = at + 3 * h->capacity;
        }
        h->rows.mass = at;
        h->rows.soft = at + h->capacity;
    }
    for (int64_t i = n; i < h->capacity; i++) {
        for (int c = 0; c < COLUMNS; c++) h->room[c * h->capacity + i] = 0;
        h->rows.soft[i] = 1;
    }
    if (h->units.length == 0) choose_units(sim, h);
    if (h->precision == HERMITE_FLOAT) make_float_room(h);
    if (active > h->room_active) {
        h->room_active = active;
        h->target = mem_resize("hermite", h->target, (size_t)active * sizeof *h->target);
        h->sum = mem_resize("hermite", h->sum, (size_t)active * sizeof *h->sum);
        h->old = mem_resize("hermite", h->old, (size_t)active * sizeof *h->old);
        h->step = mem_resize("hermite", h->step, (size_t)active * sizeof *h->step);
    }
    h->n = 0;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++) h->target[h->n++] = (int32_t)(h->base[s->kind] + s->active[a]);
}

/* On the CPU the derivatives at the start are summed in doubles. */
static bool in_floats(const struct hermite *h, int derivatives) { return h->precision == HERMITE_FLOAT && derivatives == h->p; }

static void float_row(const struct hermite *h, int64_t i)
{
    const struct hermite_floats *to = &h->floats;
    const double length = 1 / h->units.length, velocity = 1 / h->units.velocity, acc = velocity * velocity * h->units.length;
    for (int k = 0; k < 3; k++) {
        const double x = h->rows.pos[k][i] * length;
        to->high[k][i] = (float)x;
        to->low[k][i] = (float)(x - (double)to->high[k][i]);
        to->vel[k][i] = (float)((h->rows.vel[k][i] - h->units.bulk[k]) * velocity);
        if (h->p > 2) to->acc[k][i] = (float)(h->rows.acc[k][i] * acc);
    }
    to->mass[i] = (float)(h->rows.mass[i] * velocity * velocity * length);
    to->soft[i] = (float)(h->rows.soft[i] * length * length);
}

/* t: from the row's state to now; n: derivatives it keeps, a literal where this is called. */
static inline void stage_row(const struct hermite *h, const struct species *s, int64_t i, double t, int n, int derivatives)
{
    const struct hermite_rows *rows = &h->rows;
    const int64_t to = h->base[s->kind] + i;
    for (int k = 0; k < 3; k++) {
        double d[2 + HERMITE_DERIVATIVES] = {s->pos[i][k], s->vel[i][k], s->acc_exact[i][k], s->jerk[i][k]};
        if (n > 2) d[4] = s->snap[i][k];
        if (n > 3) d[5] = s->crackle[i][k];
        if (n > 4) d[6] = s->pop[i][k];
        if (n > 5) d[7] = s->lock[i][k];
        rows->pos[k][to] = hermite_taylor(d, n + 2, t);
        rows->vel[k][to] = hermite_taylor(d + 1, n + 1, t);
        if (derivatives > 2) rows->acc[k][to] = hermite_taylor(d + 2, n, t);
        if (derivatives > 3) rows->jerk[k][to] = hermite_taylor(d + 3, n - 1, t);
    }
    rows->mass[to] = h->gravity->G * s->mass[i];
    rows->soft[to] = gravity_half_soft2(h->gravity, s, i);
    if (in_floats(h, derivatives)) float_row(h, to);
}

/* --- who sums what --- */

/* The sources that a rank sums over, by segments, and the active rows on which they act, by the ranks that own these. */
struct work {
    int64_t segments, first, end;   /* segments in all; this rank's */
    int ranks;                      /* those whose targets are here: all of them, or 1, this one */
    int64_t *n;                     /* targets by rank; where ranks is 1, this one's */
    const int32_t *target;          /* places among rows, rank after rank */
};

static int64_t segments_of(const struct hermite *h)
{
    const int64_t chunks = (h->rows.n + CHUNK - 1) / CHUNK;
    return chunks < SEGMENTS ? chunks : SEGMENTS;
}

/* The first source of a segment. */
static int64_t segment_from(const struct hermite *h, int64_t segments, int64_t segment)
{
    const int64_t chunks = (h->rows.n + CHUNK - 1) / CHUNK, from = segment * chunks / segments * CHUNK;
    return from < h->rows.n ? from : h->rows.n;
}

/* Whether the sources are shared out: counted work of the busiest rank, the same on every rank. */
static bool shares_sources(struct hermite *h, int64_t segments, const int64_t *n)
{
    const int size = comm_size();
    int64_t all = 0, targets = 0, sources = 0;
    for (int r = 0; r < size; r++) {
        const int64_t rows = segment_from(h, segments, (r + 1) * segments / size) - segment_from(h, segments, r * segments / size);
        sources = rows > sources ? rows : sources;
        targets = n[r] > targets ? n[r] : targets;
        all += n[r];
    }
    const double by_sources = (double)sources * (double)(all + PREDICTION) + (double)PREDICTION * (double)all;
    const double by_targets = (double)h->rows.n * (double)(targets + PREDICTION);
    h->shared.all += (double)h->rows.n * (double)(all + PREDICTION) / size;
    h->shared.by_targets += by_targets;
    h->shared.busiest += fmin(by_sources, by_targets);
    h->shared.sums++;
    h->shared.of_sources += by_sources < by_targets;
    return by_sources < by_targets;
}

static struct work work_begin(struct hermite *h)
{
    const int size = comm_size(), rank = comm_rank();
    struct work w = {.segments = segments_of(h), .ranks = 1, .n = mem_array("hermite", int64_t, size), .target = h->target};
    w.end = w.segments;
    comm_gather_counts(h->n, w.n);
    if (!shares_sources(h, w.segments, w.n)) {
        w.n[0] = h->n;
        return w;
    }
    int64_t total = 0, before = 0, *bytes = mem_array("hermite", int64_t, size);
    for (int r = 0; r < size; r++) {
        bytes[r] = w.n[r] * (int64_t)sizeof *h->target;
        if (r < rank) before += w.n[r];
        total += w.n[r];
    }
    int32_t *all = mem_array("hermite", int32_t, total);
    memcpy(all + before, h->target, (size_t)h->n * sizeof *all);
    comm_gather_all(all, bytes);
    mem_free(bytes);
    w.target = all;
    w.ranks = size;
    w.first = rank * w.segments / size;
    w.end = (rank + 1) * w.segments / size;
    return w;
}

static void work_end(const struct hermite *h, struct work *w)
{
    if (w->target != h->target) mem_free((void *)w->target);
    mem_free(w->n);
}

/* --- prediction --- */

/* corrected: the states of the active rows are of now already. */
static void stage(const struct sim *sim, const struct hermite *h, const struct species *s, int64_t i, int derivatives,
                  bool corrected)
{
    const bool ends = timeline_active(&sim->time, s->rung[i]);
    const double t = !ends ? timeline_lag(&sim->time, s->rung[i], s->rung0[i])
                   : corrected ? 0 : timeline_step(&sim->time, s->rung0[i]);
    switch (h->p) {
    case 2: stage_row(h, s, i, t, hermite_kept(2), derivatives); break;
    case 3: stage_row(h, s, i, t, hermite_kept(3), derivatives); break;
    default: stage_row(h, s, i, t, hermite_kept(4), derivatives); break;
    }
}

/* The sources of this rank and, where others are its targets too, these. */
static void predict(const struct sim *sim, const struct hermite *h, const struct work *w, int derivatives, bool corrected)
{
    const int64_t from = segment_from(h, w->segments, w->first), to = segment_from(h, w->segments, w->end);
    for_species(sim, s) {
        const int64_t first = from - h->base[s->kind], end = to - h->base[s->kind];
#pragma omp parallel for
        for (int64_t i = first > 0 ? first : 0; i < (end < s->n ? end : s->n); i++) stage(sim, h, s, i, derivatives, corrected);
    }
    if (w->ranks == 1) return;
    int64_t targets = 0;
    for (int r = 0; r < w->ranks; r++) targets += w->n[r];
    for (int64_t t = 0; t < targets; t++) {
        const int64_t i = w->target[t];
        if (i >= from && i < to) continue;
        for_species(sim, s)
            if (i >= h->base[s->kind] && i < h->base[s->kind] + s->n)
                stage(sim, h, s, i - h->base[s->kind], derivatives, corrected);
    }
}

/* --- sums --- */

/* In the units of the floats, and back. */
static void sum_floats(const struct hermite *h, bool bare, double row[13], int64_t from, int64_t end, double *to)
{
    const struct hermite_units *u = &h->units;
    double unit = u->velocity * u->velocity / u->length;
    for (int k = 0; k < 3; k++) {
        row[k] /= u->length;
        row[3 + k] = (row[3 + k] - u->bulk[k]) / u->velocity;
        row[6 + k] /= unit;
    }
    row[12] /= u->length * u->length;
    h->gravity->kernels->hermite_float->sum[bare][h->p - 2](to, row, &h->floats, from, end);
    for (int d = 0; d < h->p; d++, unit *= u->velocity / u->length)
        for (int k = 0; k < 3; k++) to[3 * d + k] *= unit;
}

static void sum_chunk(const struct hermite *h, int derivatives, int64_t i, int64_t from, double *to)
{
    const struct hermite_rows *rows = &h->rows;
    double row[13];
    for (int k = 0; k < 3; k++) {
        row[k] = rows->pos[k][i];
        row[3 + k] = rows->vel[k][i];
        row[6 + k] = rows->acc[k][i];
        row[9 + k] = rows->jerk[k][i];
    }
    row[12] = rows->soft[i];
    const int64_t end = from + CHUNK < rows->n ? from + CHUNK : rows->n;
    const bool bare = h->gravity->form != SOFT_COMMON;
    if (in_floats(h, derivatives)) sum_floats(h, bare, row, from, end, to);
    else h->gravity->kernels->hermite->sum[bare][derivatives - 2](to, row, rows, from, end);
}

/* A target of this round: its place among rows, and where its sums go, segment by segment. */
struct aim { int64_t row, stride; double *to; };

static void sum_segment(const struct hermite *h, const struct work *w, int derivatives, const struct aim *aim, int64_t n, int64_t s)
{
    const int width = 3 * derivatives;
    const int64_t part = s - w->first, end = segment_from(h, w->segments, s + 1);
    for (int64_t b = 0; b < n; b++) memset(aim[b].to + part * aim[b].stride, 0, (size_t)width * sizeof(double));
    for (int64_t from = segment_from(h, w->segments, s); from < end; from += CHUNK)
        for (int64_t b = 0; b < n; b++) {
            double sum[3 * HERMITE_P_MAX], *to = aim[b].to + part * aim[b].stride;
            sum_chunk(h, derivatives, aim[b].row, from, sum);
            for (int k = 0; k < width; k++) to[k] += sum[k];
        }
}

/* Of each rank's targets those from `first` on, `batch` at most; their sums, `width` each, from `part` on. */
struct round { int64_t first, batch; int width; double *part; struct aim *aim; int64_t *bytes; };

/* Fills the targets and the bytes of their sums by rank. Returns how many targets there are. */
static int64_t aim_round(const struct work *w, const struct round *round)
{
    const int width = round->width;
    double *part = round->part;
    const int32_t *target = w->target;
    const int64_t segments = w->end - w->first;
    int64_t count = 0;
    for (int r = 0; r < w->ranks; target += w->n[r++]) {
        const int64_t left = w->n[r] - round->first, n = left < 0 ? 0 : left < round->batch ? left : round->batch;
        for (int64_t b = 0; b < n; b++) round->aim[count++] = (struct aim){target[round->first + b], n * width, part + b * width};
        part += segments * n * width;
        round->bytes[r] = segments * n * width * (int64_t)sizeof(double);
    }
    return count;
}

static void sum_round(const struct hermite *h, const struct work *w, int derivatives, const struct aim *aim, int64_t n)
{
#pragma omp parallel for collapse(2) schedule(dynamic, 1)
    for (int64_t turn = 0; turn < (n + TURN - 1) / TURN; turn++)
        for (int64_t s = w->first; s < w->end; s++)
            sum_segment(h, w, derivatives, aim + turn * TURN, n - turn * TURN < TURN ? n - turn * TURN : TURN, s);
}

/* The own targets' sums over all segments come, and are added in order. */
static void add_segments(struct hermite *h, const struct work *w, int64_t first, int64_t n, int width, const double *part)
{
#pragma omp parallel for
    for (int64_t b = 0; b < n; b++) {
        double *sum = h->sum[first + b][0];
        memset(sum, 0, sizeof *h->sum);
        for (int64_t s = 0; s < w->segments; s++)
            for (int k = 0; k < width; k++) sum[k] += part[(s * n + b) * width + k];
    }
}

static void sum_rows(struct hermite *h, const struct work *w, int derivatives)
{
    const int width = 3 * derivatives, size = w->ranks;
    const int64_t batch = PARTS / (w->segments * size) > TURN ? PARTS / (w->segments * size) : TURN, segments = w->end - w->first;
    int64_t most = 0, all = 0;
    for (int r = 0; r < size; r++) {
        all += w->n[r] < batch ? w->n[r] : batch;
        most = w->n[r] > most ? w->n[r] : most;
    }
    const int64_t room = (segments * all + (size > 1 ? w->segments * (h->n < batch ? h->n : batch) : 0)) * width;
    if (room > h->room_part) h->part = mem_resize("hermite", h->part, (size_t)(h->room_part = room) * sizeof(double));
    struct aim *aim = mem_array("hermite", struct aim, all);
    int64_t *out = mem_array("hermite", int64_t, 2 * size), *in = out + size;
    for (int64_t first = 0; first < most; first += batch) {
        const int64_t left = h->n - first, own = left < 0 ? 0 : left < batch ? left : batch;
        const int64_t n = aim_round(w, &(struct round){first, batch, width, h->part, aim, out});
        double *sums = size > 1 ? h->part + segments * all * width : h->part;
        sum_round(h, w, derivatives, aim, n);
        for (int r = 0; r < size && size > 1; r++)
            in[r] = ((r + 1) * w->segments / size - r * w->segments / size) * own * width * (int64_t)sizeof(double);
        if (size > 1) comm_exchange(h->part, out, sums, in);
        add_segments(h, w, first, own, width, sums);
    }
    mem_free(out);
    mem_free(aim);
}

/* On the device, where all ranks have one that takes it. */
static bool evaluate_there(struct sim *sim, struct hermite *h, int derivatives, bool corrected)
{
    double done = hermite_on_device(sim, h) && hermite_evaluate_device(sim, h, derivatives, corrected);
    comm_min(&done, 1);
    return done > 0;
}

void hermite_evaluate(struct sim *sim, struct hermite *h, int derivatives, bool corrected)
{
    h->gravity->pairs = h->n * h->rows.n;
    h->noise = float_noise;
    if (sim->device && evaluate_there(sim, h, derivatives, corrected)) return;
    if (!in_floats(h, derivatives)) h->noise = 0;
    struct work w = work_begin(h);
    predict(sim, h, &w, derivatives, corrected);
    sum_rows(h, &w, derivatives);
    work_end(h, &w);
}

void hermite_free(struct hermite *h)
{
    mem_free(h->room);
    mem_free(h->float_room);
    mem_free(h->target);
    mem_free(h->sum);
    mem_free(h->old);
    mem_free(h->step);
    mem_free(h->part);
    hermite_engine_free(h->engine);
}
