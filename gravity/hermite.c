/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integrators hermite4, hermite6 and hermite8: direct N-body with block steps (Makino & Aarseth 1992; Nitadori &
 * Makino 2008; Harfst et al. 2007). The acceleration and its derivatives are summed in hermite_sums.c; the module
 * `gravity` gives G and the softening and books the potential energy, in double. See doc/manual/hermite.md. */
#include "comm.h"
#include "hermite.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const enum column hermite_column[] = {COLUMN_acc_exact, COLUMN_jerk, COLUMN_snap, COLUMN_crackle, COLUMN_pop, COLUMN_lock};

static const struct saved saved[] = {
    {"guarded", offsetof(struct hermite, guarded), sizeof(int64_t)},
    {"units", offsetof(struct hermite, units), sizeof(struct hermite_units)},
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
/* The criterion of order 8 holds derivatives in which roundings of floats show too much (doc/manual/hermite.md). */
#define PRECISION {"precision", PARAM_CHOICE, "", "auto", 0, 0, "auto|double|float", \
    "of pairs: float takes two floats a coordinate and errs by 3e-7; sums and rows are doubles; auto: float on a device", true, \
    offsetof(struct hermite, precision)},
PARAMS(4, "0.01", "of Aarseth's step sqrt(eta (|a||s| + |j|^2)/(|j||c| + |s|^2))", PRECISION);
PARAMS(6, "0.5", "of the step eta (A1/A4)^(1/3), A_k^2 = |f(k-1)||f(k+1)| + |f(k)|^2, f(k) the derivatives of a", PRECISION);
PARAMS(8, "0.75", "of the step eta (A1/A6)^(1/5), A_k as for hermite6", );

static double *kept(const struct species *s, int derivative, int64_t i)
{
    return (double *)species_column(s, hermite_column[derivative]) + 3 * i;
}

static void declare(struct sim *sim, struct hermite *h, int p)
{
    h->p = p;
    h->gravity = sim_state(sim, "gravity");
    for (int s = 0; s < N_SPECIES; s++)
        for (int d = 0; d < hermite_kept(p); d++) species_need(&sim->species[s], hermite_column[d]);
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

static void begin(struct sim *sim, void *state)
{
    const struct hermite *h = state;
    if (sim->device && !hermite_on_device(sim, h))
        log_line("hermite%d: sums in doubles are the CPU's; the device has orders 4 and 6, in floats", 2 * h->p);
}

/* Etas with which an unsoftened pair of eccentricity 0.99 still keeps its energy to 1 % in 100 orbits: doc/manual/hermite.md. */
static void warn(struct sim *sim, void *state)
{
    static const double most[] = {[2] = 0.02, [3] = 0.75, [4] = 1};
    const struct hermite *h = state;
    (void)sim;
    if (h->eta > most[h->p])
        log_warning("hermite%d.eta = %g: above %g close pairs lose 1 %% of their energy or more in 100 orbits (eccentricity 0.99)",
                    2 * h->p, h->eta, most[h->p]);
}

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
    if (comm_size() > 1 && h->shared.sums > 0)
        log_line("sources were shared out among the ranks in %lld of %lld sums, targets in the others: by counted work an "
                 "efficiency of %.3f (%.3f with targets alone)", (long long)h->shared.of_sources, (long long)h->shared.sums,
                 h->shared.all / h->shared.busiest, h->shared.all / h->shared.by_targets);
    hermite_free(h);
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

/* Whether the highest derivatives at the end of a step are more than what errors of the sums make of them, which differences
 * over a short step magnify: `noise` of the acceleration, or of the mean pull of all where single ones cancel. f0: the
 * derivatives at its start; f1: at its end, all of them. */
static bool tell_steps(const struct hermite *h, double (*f0)[3], double (*f1)[3], double dt)
{
    const int p = h->p, top = 2 * p - 2;
    double error[3];
    for (int k = top - 1; k <= top + 1; k++) {
        double sum = k < p ? size(f1[k]) : fabs(hermite_end[p][k - p][0][0]) * pow(dt, -k) * hermite_mean_pull(h);
        for (int m = 0; m < p && k >= p; m++)
            sum += pow(dt, m - k) * (fabs(hermite_end[p][k - p][0][m]) * size(f0[m])
                                     + fabs(hermite_end[p][k - p][1][m]) * size(f1[m]));
        error[k - top + 1] = h->noise * sum;
    }
    return size(f1[top - 1]) * size(f1[top + 1]) + size(f1[top]) * size(f1[top]) > error[0] * error[2] + error[1] * error[1];
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
        hermite_evaluate(sim, h, 4, true);
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
    hermite_make_room(sim, h);
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
    hermite_evaluate(sim, h, h->p, false);
}

static void correct_row(const struct sim *sim, const struct hermite *h, struct species *s, int64_t i, int64_t t)
{
    struct hermite_old *old = &h->old[t];
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
    h->step[t] = 2 * dt;
    if (h->noise == 0 || tell_steps(h, old->f, end, dt)) h->step[t] = fmin(aarseth(h->eta, 2 * h->p, end), 2 * dt);
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
    double first = 0;
    if (h->p < HERMITE_P_MAX) return h->iterations;
    for_species(sim, s)
        for (int64_t e = 0; e < s->n_ending; e++) first += timeline_began(&sim->time, s->rung0[s->ending[e]]) == 0;
    comm_max(&first, 1);
    return first > 0 && h->iterations < FIRST ? FIRST : h->iterations;
}

static void correct(struct sim *sim, void *state)
{
    struct hermite *h = state;
    if (sim->time.tick == 0) return;
    uint64_t columns = (uint64_t)1 << COLUMN_pos | (uint64_t)1 << COLUMN_vel;
    for (int d = 0; d < hermite_kept(h->p); d++) columns |= (uint64_t)1 << hermite_column[d];
    correct_rows(sim, h);
    for (int64_t n = iterations(sim, h); n > 1; n--) {
        ranks_share(sim, columns);
        hermite_evaluate(sim, h, h->p, true);
        correct_rows(sim, h);
    }
    for (int64_t t = 0; t < h->n; t++) h->step[t] = guarded(h, h->step[t]);
    h->block[ilogb((double)sim->ending)]++;
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
        .whole = true, .state_bytes = sizeof(struct hermite), .saved = saved, .declare = declare##order, .begin = begin, \
        .end = end, \
        .hook = {[HOOK_FORCE] = force, [HOOK_CORRECT] = correct, [HOOK_LIMIT] = limit}, .reason = reason, \
        .warn = warn, \
    }
HERMITE(4, "Hermite's scheme of 4th order, direct sums");
HERMITE(6, "Hermite's scheme of 6th order, direct sums");
HERMITE(8, "Hermite's scheme of 8th order, direct sums");
