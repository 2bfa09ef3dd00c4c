/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integrators hermite4, hermite6 and hermite8: direct N-body with block steps (Makino & Aarseth 1992; Nitadori &
 * Makino 2008; Harfst et al. 2007). The acceleration and its derivatives are summed here, in double, over all rows, which
 * are predicted to now; the module `gravity` gives G and the softening and books the potential energy, also in double.
 * Each row's sum goes over the sources in chunks of one size, in order: the same bits on any number of threads and
 * ranks. See doc/manual/hermite.md. */
#include "comm.h"
#include "gravity.h"
#include "hermite_scheme.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sources of a partial sum: as many as lie in the nearest cache while a turn of targets goes over them (with 2048, floats
 * are 1.3 to 2 times slower: tests/bench_gravity.c). Targets of one thread's turn. Partial sums kept at a time. */
enum { CHUNK = 512, TURN = 16, PARTS = 1 << 18 };
enum { DOUBLE, FLOAT };     /* precision */

static const enum column kept_column[] = {COLUMN_acc_exact, COLUMN_jerk, COLUMN_snap, COLUMN_crackle, COLUMN_pop, COLUMN_lock};

/* A row's state at the start of its step: position, velocity, p derivatives. */
struct old { double pos[3], vel[3], f[HERMITE_P_MAX][3]; };

struct hermite {
    double eta, dt_min;
    int64_t iterations;
    int precision;
    int p;                      /* derivatives summed: half the order */
    struct gravity *gravity;
    struct hermite_rows rows;
    double *room;               /* of rows */
    struct hermite_floats floats;   /* the same rows in floats, where sums are in floats */
    float *float_room;              /* of floats */
    double length, velocity;        /* their units; saved */
    double bulk[3];                 /* velocity from which theirs count, so that none is lost to a common motion; saved */
    int64_t capacity;           /* of rows */
    int64_t base[N_SPECIES];    /* where a species begins among rows */
    /* One entry an own active row, species by species. */
    int32_t *target;            /* its place among rows */
    double (*sum)[HERMITE_P_MAX][3];
    struct old *old;
    double *step;               /* that the criterion allows */
    int64_t n, room_active;
    double *part;               /* partial sums of a batch: chunk, target, derivative, axis */
    int64_t room_part;
    int64_t guarded;            /* steps that dt_min has kept from being shorter; saved */
};

static const struct saved saved[] = {
    {"guarded", offsetof(struct hermite, guarded), sizeof(int64_t)},
    {"length", offsetof(struct hermite, length), sizeof(double)},
    {"velocity", offsetof(struct hermite, velocity), sizeof(double)},
    {"bulk", offsetof(struct hermite, bulk), sizeof(double[3])},
    {0}
};

#define PARAMS(order, eta_default, text, ...) \
    static const struct param params##order[] = { \
        {"eta", PARAM_REAL, "", eta_default, 1e-6, 10, NULL, text, true, offsetof(struct hermite, eta)}, \
        {"iterations", PARAM_COUNT, "", "1", 1, 10, NULL, "n of P(EC)^n: evaluations and corrections a step", true, \
         offsetof(struct hermite, iterations)}, \
        {"dt_min", PARAM_REAL, "time", "none", 1e-300, 1e300, NULL, \
         "no row's step is shorter, whatever its criterion; default: the tick, where the run ends", true, \
         offsetof(struct hermite, dt_min)}, \
        __VA_ARGS__ {0}}
/* Of order 4 alone: the criteria of the others hold derivatives in which roundings of floats show (doc/manual/hermite.md). */
#define PRECISION {"precision", PARAM_CHOICE, "", "double", 0, 0, "double|float", \
    "of pairs: float takes two floats a coordinate and errs by 3e-7; sums and rows are doubles", true, \
    offsetof(struct hermite, precision)},
PARAMS(4, "0.01", "of Aarseth's step sqrt(eta (|a||s| + |j|^2)/(|j||c| + |s|^2))", PRECISION);
PARAMS(6, "0.5", "of the step eta (A1/A4)^(1/3), A_k^2 = |f(k-1)||f(k+1)| + |f(k)|^2, f(k) the derivatives of a", );
PARAMS(8, "0.75", "of the step eta (A1/A6)^(1/5), A_k as for hermite6", );

static double *kept(const struct species *s, int derivative, int64_t i)
{
    return (double *)species_column(s, kept_column[derivative]) + 3 * i;
}

static void declare(struct sim *sim, struct hermite *h, int p)
{
    h->p = p;
    h->gravity = sim_state(sim, "gravity");
    for (int s = 0; s < N_SPECIES; s++)
        for (int d = 0; d < hermite_kept(p); d++) species_need(&sim->species[s], kept_column[d]);
    if (!h->gravity) {
        problems_add(&sim->problems, "time.integrator: hermite%d needs a block \"gravity\"", 2 * p);
        return;
    }
    for (int u = 0; u < sim->n_use; u++) {
        const struct module *module = sim->use[u].module;
        bool pushes = module->hook[HOOK_FORCE] || module->hook[HOOK_SOURCE] || module->hook[HOOK_EVENT];
        if (module->kind == MODULE_BLOCK && pushes && sim->use[u].state != h->gravity)
            problems_add(&sim->problems, "time.integrator: hermite%d cannot be used with the block \"%s\", whose forces come "
                         "without derivatives", 2 * p, module->name);
    }
    gravity_leave_forces(sim, h->gravity);
}

static void declare4(struct sim *sim, void *state) { declare(sim, state, 2); }
static void declare6(struct sim *sim, void *state) { declare(sim, state, 3); }
static void declare8(struct sim *sim, void *state) { declare(sim, state, 4); }

struct place { double pos[3]; uint64_t id; };

static int by_place(const void *a, const void *b)
{
    const struct place *left = a, *right = b;
    for (int k = 0; k < 3; k++)
        if (left->pos[k] != right->pos[k]) return left->pos[k] < right->pos[k] ? -1 : 1;
    return (left->id > right->id) - (left->id < right->id);
}

/* Two rows at one place do not pull without a softening; apart by the least they pull without limit. */
static void check_places(const struct sim *sim, const struct hermite *h)
{
    int64_t n = 0, rows = 0;
    for_species(sim, s) rows += s->n;
    struct place *place = mem_array("hermite", struct place, rows);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            if (gravity_half_soft2(h->gravity, s, i) > 0) continue;
            memcpy(place[n].pos, s->pos[i], sizeof place[n].pos);
            place[n++].id = s->id[i];
        }
    qsort(place, (size_t)n, sizeof *place, by_place);
    for (int64_t i = 1; i < n; i++)
        if (memcmp(place[i - 1].pos, place[i].pos, sizeof place[i].pos) == 0)
            fail(STATUS_INPUT, "hermite%d: particles %llu and %llu lie at one place and have no softening: their force is without "
                 "limit; give gravity.softening, or move one", 2 * h->p, (unsigned long long)place[i - 1].id,
                 (unsigned long long)place[i].id);
    mem_free(place);
}

static void end(struct sim *sim, void *state)
{
    struct hermite *h = state;
    (void)sim;
    if (h->guarded > 0) log_line("%lld steps were held at dt_min = %g", (long long)h->guarded, h->dt_min);
    mem_free(h->room);
    mem_free(h->float_room);
    mem_free(h->target);
    mem_free(h->sum);
    mem_free(h->old);
    mem_free(h->step);
    mem_free(h->part);
}

/* --- rows, predicted to now --- */

/* Powers of two, so that nothing is rounded, by which the powers that the derivatives hold stay within floats: lengths
 * from 1e-10 to 1e3 of the set and their powers -9. A few far rows shall not count: the mean is of logarithms. */
static void choose_units(const struct sim *sim, struct hermite *h)
{
    enum { BELOW = 10 };
    double sum = 0, mass = 0, n = 0, centre[3] = {0};
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            mass += s->mass[i];
            for (int k = 0; k < 3; k++) {
                centre[k] += s->mass[i] * s->pos[i][k];
                h->bulk[k] += s->mass[i] * s->vel[i][k];
            }
        }
    for (int k = 0; k < 3 && mass > 0; k++) {
        centre[k] /= mass;
        h->bulk[k] /= mass;
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
    h->length = ldexp(1, (int)floor(log2(size)) - BELOW);
    h->velocity = velocity2 > 0 ? ldexp(1, (int)floor(0.5 * log2(velocity2))) : 1;
}

static void make_float_room(struct hermite *h)
{
    enum { COLUMNS = 11 };
    h->float_room = mem_resize("hermite", h->float_room, (size_t)(COLUMNS * h->capacity) * sizeof(float));
    float **const column[] = {h->floats.high, h->floats.low, h->floats.vel};
    for (int c = 0; c < COLUMNS; c++)
        for (int64_t i = h->rows.n; i < h->capacity; i++) h->float_room[c * h->capacity + i] = c == COLUMNS - 1;
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) column[c][k] = h->float_room + (3 * c + k) * h->capacity;
    h->floats.mass = h->float_room + (COLUMNS - 2) * h->capacity;
    h->floats.soft = h->float_room + (COLUMNS - 1) * h->capacity;
}

static void make_room(const struct sim *sim, struct hermite *h)
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
    if (h->precision == FLOAT) {
        if (h->length == 0) choose_units(sim, h);
        make_float_room(h);
    }
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

/* The derivatives at the start are summed in doubles. */
static bool in_floats(const struct hermite *h, int derivatives) { return h->precision == FLOAT && derivatives == h->p; }

static void float_row(const struct hermite *h, int64_t i)
{
    const struct hermite_floats *to = &h->floats;
    const double length = 1 / h->length, velocity = 1 / h->velocity;
    for (int k = 0; k < 3; k++) {
        const double x = h->rows.pos[k][i] * length;
        to->high[k][i] = (float)x;
        to->low[k][i] = (float)(x - (double)to->high[k][i]);
        to->vel[k][i] = (float)((h->rows.vel[k][i] - h->bulk[k]) * velocity);
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

/* corrected: the states of the active rows are of now already. */
static void stage(const struct sim *sim, struct hermite *h, int derivatives, bool corrected)
{
    for_species(sim, s) {
#pragma omp parallel for
        for (int64_t i = 0; i < s->n; i++) {
            bool ends = timeline_active(&sim->time, s->rung[i]);
            double t = !ends ? timeline_lag(&sim->time, s->rung[i], s->rung0[i])
                     : corrected ? 0 : timeline_step(&sim->time, s->rung0[i]);
            switch (h->p) {
            case 2: stage_row(h, s, i, t, hermite_kept(2), derivatives); break;
            case 3: stage_row(h, s, i, t, hermite_kept(3), derivatives); break;
            default: stage_row(h, s, i, t, hermite_kept(4), derivatives); break;
            }
        }
    }
}

/* --- sums --- */

/* In the units of the floats, and back. */
static void sum_floats(const struct hermite *h, bool bare, double row[13], int64_t from, int64_t end, double *to)
{
    const double acc = h->velocity * h->velocity / h->length, jerk = acc * h->velocity / h->length;
    for (int k = 0; k < 3; k++) {
        row[k] /= h->length;
        row[3 + k] = (row[3 + k] - h->bulk[k]) / h->velocity;
    }
    row[12] /= h->length * h->length;
    h->gravity->kernels->hermite_float->sum[bare](to, row, &h->floats, from, end);
    for (int k = 0; k < 3; k++) {
        to[k] *= acc;
        to[3 + k] *= jerk;
    }
}

static void sum_chunk(const struct hermite *h, int derivatives, int64_t target, int64_t chunk, double *to)
{
    const struct hermite_rows *rows = &h->rows;
    const int64_t i = h->target[target], from = chunk * CHUNK;
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

static void evaluate(struct hermite *h, int derivatives)
{
    const int64_t chunks = (h->rows.n + CHUNK - 1) / CHUNK, width = 3 * HERMITE_P_MAX;
    const int64_t batch = PARTS / chunks > TURN ? PARTS / chunks / TURN * TURN : TURN, most = h->n < batch ? h->n : batch;
    if (chunks * most * width > h->room_part) {
        h->room_part = chunks * most * width;
        h->part = mem_resize("hermite", h->part, (size_t)h->room_part * sizeof(double));
    }
    for (int64_t first = 0; first < h->n; first += batch) {
        const int64_t n = h->n - first < batch ? h->n - first : batch;
#pragma omp parallel
        {
#pragma omp for collapse(2) schedule(dynamic, 1)
            for (int64_t turn = 0; turn < (n + TURN - 1) / TURN; turn++)
                for (int64_t c = 0; c < chunks; c++)
                    for (int64_t b = turn * TURN; b < (turn + 1) * TURN && b < n; b++)
                        sum_chunk(h, derivatives, first + b, c, h->part + (c * n + b) * width);
#pragma omp for
            for (int64_t b = 0; b < n; b++) {
                double *sum = h->sum[first + b][0];
                memset(sum, 0, sizeof *h->sum);
                for (int64_t c = 0; c < chunks; c++)
                    for (int w = 0; w < 3 * derivatives; w++) sum[w] += h->part[(c * n + b) * width + w];
            }
        }
    }
    h->gravity->pairs = h->n * h->rows.n;
}

/* --- steps --- */

static double size(const double f[3]) { return sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]); }

/* Aarseth's step, generalised (Nitadori & Makino 2008): f holds the derivatives of the acceleration, order of them. */
static double aarseth(double eta, int order, double (*f)[3])
{
    double a[2];
    for (int end = 0; end < 2; end++) {
        int k = end ? order - 2 : 1;
        double middle = size(f[k]);
        a[end] = sqrt(size(f[k - 1]) * size(f[k + 1]) + middle * middle);
    }
    if (!(a[1] > 0)) return INFINITY;
    return (order == 4 ? sqrt(eta) : eta) * pow(a[0] / a[1], 1.0 / (order - 3));
}

static double guarded(struct hermite *h, double dt)
{
    if (!(dt < h->dt_min)) return dt;
    h->guarded++;
    return h->dt_min;
}

/* --- hooks --- */

/* The first two passes over all rows give the derivatives at the start: the second knows the accelerations and jerks
 * of the sources. The first steps are a part of Aarseth's, since the criteria of orders 6 and 8 need more derivatives. */
static void start(struct sim *sim, struct hermite *h)
{
    static const double caution = 0.125;
    const int n = hermite_kept(h->p);
    const uint64_t columns = (uint64_t)1 << COLUMN_acc_exact | (uint64_t)1 << COLUMN_jerk | (uint64_t)1 << COLUMN_snap
                           | (uint64_t)1 << COLUMN_crackle;
    check_places(sim, h);
    for (int pass = 0; pass < 2; pass++) {
        stage(sim, h, 4, true);
        evaluate(h, 4);
        int64_t t = 0;
        for_species(sim, s)
            for (int64_t a = 0; a < s->n_active; a++, t++)
                for (int d = 0; d < (pass ? HERMITE_P_MAX : 2) && d < n; d++)
                    memcpy(kept(s, d, s->active[a]), h->sum[t][d], sizeof h->sum[t][d]);
        ranks_share(sim, columns);
    }
    int64_t t = 0;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++, t++) {
            for (int k = 0; k < 3; k++) s->acc[s->active[a]][k] = (float)h->sum[t][0][k];
            h->step[t] = guarded(h, (h->p == 2 ? 1 : caution) * aarseth(h->eta, 4, h->sum[t]));
        }
}

static void force(struct sim *sim, void *state)
{
    struct hermite *h = state;
    make_room(sim, h);
    if (sim->time.tick == 0) {
        start(sim, h);
        return;
    }
    int64_t t = 0;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++, t++) {
            int64_t i = s->active[a];
            memcpy(h->old[t].pos, s->pos[i], sizeof h->old[t].pos);
            memcpy(h->old[t].vel, s->vel[i], sizeof h->old[t].vel);
            for (int d = 0; d < h->p; d++) memcpy(h->old[t].f[d], kept(s, d, i), sizeof h->old[t].f[d]);
        }
    stage(sim, h, h->p, false);
    evaluate(h, h->p);
}

static void correct_row(const struct sim *sim, struct hermite *h, struct species *s, int64_t i, int64_t t)
{
    const struct old *old = &h->old[t];
    const double dt = timeline_step(&sim->time, s->rung0[i]);
    double end[HERMITE_DERIVATIVES][3];
    for (int k = 0; k < 3; k++) {
        double d0[1 + HERMITE_P_MAX] = {old->vel[k]}, d1[1 + HERMITE_DERIVATIVES];
        for (int m = 0; m < h->p; m++) {
            d0[1 + m] = old->f[m][k];
            d1[1 + m] = h->sum[t][m][k];
        }
        d1[0] = s->vel[i][k] = hermite_integrate(h->p, old->vel[k], d0 + 1, d1 + 1, dt);
        s->pos[i][k] = hermite_integrate(h->p, old->pos[k], d0, d1, dt);
        hermite_interpolate(h->p, d0 + 1, d1 + 1, dt);
        for (int m = 0; m < 2 * h->p; m++) end[m][k] = d1[1 + m];
        for (int m = 0; m < hermite_kept(h->p); m++) kept(s, m, i)[k] = d1[1 + m];
        s->acc[i][k] = (float)d1[1];
    }
    h->step[t] = fmin(aarseth(h->eta, 2 * h->p, end), 2 * dt);
}

static void correct_rows(struct sim *sim, struct hermite *h)
{
    int64_t first = 0;
    for_species(sim, s) {
#pragma omp parallel for
        for (int64_t a = 0; a < s->n_active; a++) correct_row(sim, h, s, s->active[a], first + a);
        first += s->n_active;
    }
}

/* The derivatives of order 8 that pairs do not give are zero at the start: more corrections make up for that. */
static int64_t iterations(const struct sim *sim, const struct hermite *h)
{
    enum { FIRST = 3 };
    bool first = false;
    for_species(sim, s)
        for (int64_t e = 0; e < s->n_ending && h->p == HERMITE_P_MAX; e++)
            first |= timeline_began(&sim->time, s->rung0[s->ending[e]]) == 0;
    return first && h->iterations < FIRST ? FIRST : h->iterations;
}

static void correct(struct sim *sim, void *state)
{
    struct hermite *h = state;
    if (sim->time.tick == 0) return;
    uint64_t columns = (uint64_t)1 << COLUMN_pos | (uint64_t)1 << COLUMN_vel;
    for (int d = 0; d < hermite_kept(h->p); d++) columns |= (uint64_t)1 << kept_column[d];
    correct_rows(sim, h);
    for (int64_t n = iterations(sim, h); n > 1; n--) {
        ranks_share(sim, columns);
        stage(sim, h, h->p, true);
        evaluate(h, h->p);
        correct_rows(sim, h);
    }
    for (int64_t t = 0; t < h->n; t++) h->step[t] = guarded(h, h->step[t]);
    sim->fresh_potential = false;
}

static void limit(struct sim *sim, void *state)
{
    const struct hermite *h = state;
    int64_t t = 0;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++, t++)
            s->dt[s->active[a]] = fminf(s->dt[s->active[a]], (float)h->step[t]);
}

static void reason(const struct sim *sim, const void *state, const struct species *s, int64_t i, struct step_reason *step)
{
    const struct hermite *h = state;
    (void)sim;
    if ((double)s->dt[i] < step->dt) *step = (struct step_reason){(double)s->dt[i], h->p == 2 ? "hermite4.eta"
                                                                   : h->p == 3 ? "hermite6.eta" : "hermite8.eta"};
}

#define HERMITE(order, text) \
    const struct module hermite##order##_module = { \
        .name = "hermite" #order, .doc = text, .kind = MODULE_INTEGRATOR, .params = params##order, .open_space = true, \
        .whole = true, .state_bytes = sizeof(struct hermite), .saved = saved, .declare = declare##order, .end = end, \
        .hook = {[HOOK_FORCE] = force, [HOOK_CORRECT] = correct, [HOOK_LIMIT] = limit}, .reason = reason, \
    }
HERMITE(4, "Hermite's scheme of 4th order, direct sums in double");
HERMITE(6, "Hermite's scheme of 6th order, direct sums in double");
HERMITE(8, "Hermite's scheme of 8th order, direct sums in double");
