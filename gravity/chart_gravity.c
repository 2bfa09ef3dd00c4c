/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart gravity`: errors of forces against their CPU time: solvers, orders, openings, sizes of groups
 * and leaves, precision, and the settings that `accuracy` picks, beside what others need; errors against
 * radius. The table of `accuracy` (check.c) names rows of the shipped doc/charts/gravity.csv. */
#include "draw/chart.h"
#include "gravity.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include <math.h>
#include <string.h>

struct chart_gravity {
    int64_t n, sample;
    double softening;
    int set;
    char *file;
    struct param_list tolerance, angle, accuracy;
};

static const struct param params[] = {
    {"n", PARAM_COUNT, "", "1e6", 1000, 1e9, NULL, "number of particles", false, offsetof(struct chart_gravity, n)},
    {"set", PARAM_CHOICE, "", "all", 0, 0, "plummer|uniform|clumped|all|none", "generator of the particles", false,
     offsetof(struct chart_gravity, set)},
    {"file", PARAM_TEXT, "", "none", 0, 0, NULL, "particles of a snapshot too, whatever n; its name becomes the set's", false,
     offsetof(struct chart_gravity, file)},
    {"softening", PARAM_REAL, "", "0.01", 0, 1, NULL, "softening length; G = M = 1", false,
     offsetof(struct chart_gravity, softening)},
    {"sample", PARAM_COUNT, "", "4000", 10, 1e6, NULL, "particles whose errors are measured", false,
     offsetof(struct chart_gravity, sample)},
    {"tolerance", PARAM_LIST, "", "1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5", 1e-9, 10, NULL, "of fmm, orders 3 to 6", false,
     offsetof(struct chart_gravity, tolerance)},
    {"angle", PARAM_LIST, "", "1.2, 1, 0.8, 0.6, 0.45", 0.05, 2, NULL, "opening angles of tree, orders 1 and 2", false,
     offsetof(struct chart_gravity, angle)},
    {"accuracy", PARAM_LIST, "", "1e-2, 1e-3, 1e-4", 1e-7, 0.3, NULL, "what gravity.accuracy is asked", false,
     offsetof(struct chart_gravity, accuracy)},
    {0}
};

/* What others need for Plummer's sphere of 1e6, eps 0.01: one force with the tree on one core of another processor
 * with AVX-512, which does 1e9 pairs in double in 1.65 s. */
struct peer { const char *name, *setting; double cpu, rms, p99, max; };
static const struct peer peers[] = {
    {"FDPS 7 monopole", "theta 1.0", 0.71, 6.7e-3, 1.9e-2, 7.8e-2}, {"FDPS 7 monopole", "theta 0.8", 0.73, 2.3e-3, 6.3e-3, 1.4e-2},
    {"FDPS 7 monopole", "theta 0.7", 0.89, 1.5e-3, 4.6e-3, 1.5e-2}, {"FDPS 7 monopole", "theta 0.6", 1.29, 7.8e-4, 2.7e-3, 6.1e-3},
    {"FDPS 7 monopole", "theta 0.5", 1.58, 4.5e-4, 1.7e-3, 5.0e-3}, {"FDPS 7 monopole", "theta 0.4", 2.20, 2.4e-4, 8.4e-4, 2.6e-3},
    {"FDPS 7 monopole", "theta 0.3", 4.01, 1.0e-4, 3.7e-4, 1.1e-3},
    {"FDPS 7 quadrupole", "theta 0.8", 1.05, 1.5e-3, NAN, NAN}, {"FDPS 7 quadrupole", "theta 0.6", 1.95, 4.0e-4, NAN, NAN},
    {"FDPS 7 quadrupole", "theta 0.7", 1.26, 9.0e-4, NAN, NAN}, {"FDPS 7 quadrupole", "theta 0.5", 2.48, 1.9e-4, 6.0e-4, 2.6e-3},
    {"FDPS 7 quadrupole", "theta 0.4", 3.75, 9.8e-5, 3.3e-4, 1.1e-3},
    {"FDPS 7 quadrupole", "theta 0.3", 7.30, 3.5e-5, 1.1e-4, 4.1e-4},
    {"falcON", "theta 0.6", 0.86, 5.5e-3, 2.2e-2, 6.5e-2}, {"falcON", "theta 0.4", 1.62, 3.0e-3, 1.2e-2, 5.4e-2},
    {"falcON", "theta 0.5", 1.09, 4.3e-3, 1.7e-2, 5.6e-2},
    {"GADGET-4 FMM", "p 3 alpha 0.005", 4.35, 1.2e-3, 3.8e-3, 1.0e-2},
    {"GADGET-4 FMM", "p 4 alpha 0.005", 5.33, 4.4e-4, 1.5e-3, 4.2e-3},
    {"GADGET-4 FMM", "p 4 alpha 0.001", 5.45, 2.3e-4, 7.1e-4, 1.8e-3}, {"GADGET-2", "alpha 0.005", 7.2, 2.3e-3, 5.6e-3, 1.2e-2},
    {"SWIFT FMM", "geometric 0.7", 4.5, 1.5e-3, 5.1e-3, 3.4e-2}, {"SWIFT FMM", "adaptive 1e-3", 8.7, 2.0e-4, 5.7e-4, 3.9e-3},
    {"SWIFT FMM", "adaptive 1e-4", 42.4, 6.9e-5, 1.7e-4, 1.7e-3},
    {"GADGET-4 tree", "p 3 alpha 0.001", 22.7, 3.1e-4, 7.3e-4, 1.2e-3},
};

static const char *const sets[] = {"plummer", "uniform", "clumped"};
enum { SETS = sizeof sets / sizeof *sets };

/* Everything about one set of particles. */
struct study {
    struct chart_sheet *sheet;
    const char *set;
    int64_t n;
    struct sim *sim;
    struct gravity *g;
    struct gravity_reference reference;
};

static void add_peers(struct chart_sheet *sheet)
{
    for (size_t k = 0; k < sizeof peers / sizeof *peers; k++)
        chart_cited(sheet, peers[k].name, "plummer,1000000,%s %s,%s,,,,,,,%.2f,%.1e,,%.1e,%.1e,,",
                    peers[k].name, peers[k].setting, peers[k].name, peers[k].cpu, peers[k].rms, peers[k].p99, peers[k].max);
}

/* From a file, if it is not NULL, else from the generator of that name. */
static struct study study_begin(struct chart_sheet *sheet, const struct chart_gravity *c, const char *set, const char *file)
{
    char *start = file ? mem_format("charts", "start.file=%s", file) : mem_format("charts", "start.generator=%s", set);
    char *n = file ? mem_text("charts", "title=forces") : mem_format("charts", "start.n=%lld", (long long)c->n);
    char *softening = mem_format("charts", "gravity.softening=%.9g", c->softening);
    const char *const assign[] = {"units={G: 1}", "start={}", start, n, "time={end: 1}", "output={snapshot_every: 1}",
                                  "gravity={solver: fmm}", softening, NULL};
    struct study s = {.sheet = sheet, .set = set, .sim = chart_sim(NULL, assign)};
    mem_free(start);
    mem_free(n);
    mem_free(softening);
    s.g = sim_state(s.sim, "gravity");
    s.g->checked = 1;
    s.n = gravity_count_rows(s.sim);
    gravity_force(s.sim);       /* the tree puts the rows in order */
    s.reference = gravity_reference_make(s.sim, s.g, c->sample);
    return s;
}

/* One setting: parameters are as a scene would have them. */
static void add_setting(struct study *s, const char *more)
{
    const struct gravity_opening *o = &s->g->opening;
    struct gravity_cost least = {INFINITY, INFINITY};
    struct gravity_errors e = {0};
    s->sim->tree.leaf_size = 0;
    gravity_configure(s->sim, s->g);
    for (int64_t k = 0; k < chart_repeats(s->sheet); k++) {
        struct gravity_cost cost = gravity_force(s->sim);
        if (cost.build + cost.walk < least.build + least.walk) least = cost;
    }
    e = gravity_reference_compare(s->sim, &s->reference);
    bool tree = o->solver == SOLVER_TREE, rough = gravity_refinement(s->g) == GRAVITY_ROUGH;
    char method[64];
    snprintf(method, sizeof method, "%s order %d", tree ? "tree" : "fmm", o->order);
    const double opening = (tree ? o->theta : o->alpha) * s->g->scale;
    const char *series = !*more ? method : strncmp(more, " by", 3) == 0 ? "by accuracy" : "fmm order 4 other sizes";
    chart_row(s->sheet, "%s,%lld,%s %.3g%s,%s,%d,%.3g,%d,%d,%s,%.4f,%.4f,%.3e,%.3e,%.3e,%.3e,%.3e,", s->set,
              (long long)s->n, method, opening, more, series, o->order, opening, o->group_size, o->leaf_size,
              rough ? "rough" : "float", least.build, least.build + least.walk, e.rms, e.median, e.p99, e.max,
              gravity_reference_held(s->sim, &s->reference));
}

static void add_fmm(struct study *s, int order, double tolerance, const char *more)
{
    s->g->solver = SOLVER_FMM;
    s->g->order = order;
    s->g->tolerance = tolerance;
    add_setting(s, more);
}

static void sweep_fmm(struct study *s, const struct chart_gravity *c)
{
    for (int order = GRAVITY_ORDER_MIN; order <= GRAVITY_ORDER_MAX; order++)
        for (int k = 0; k < c->tolerance.n; k++) add_fmm(s, order, c->tolerance.value[k], "");
}

static void sweep_tree(struct study *s, const struct chart_gravity *c)
{
    s->g->solver = SOLVER_TREE;
    s->g->tolerance = NAN;
    for (int order = 1; order <= 2; order++)
        for (int k = 0; k < c->angle.n; k++) {
            s->g->order = order;
            s->g->opening_angle = c->angle.value[k];
            add_setting(s, "");
        }
    s->g->opening_angle = NAN;
}

/* Sizes and precision, about a setting in the middle of the front. */
static void sweep_sizes(struct study *s)
{
    const struct { int64_t group, leaf; int precision; const char *more; } other[] = {
        {64, 0, 0, " group 64"}, {256, 0, 0, " group 256"}, {512, 0, 0, " group 512"}, {0, 32, 0, " leaf 32"},
        {0, 96, 0, " leaf 96"}, {0, 0, PRECISION_FLOAT, " float"},
    };
    for (size_t k = 0; k < sizeof other / sizeof *other; k++) {
        s->g->group_size = other[k].group;
        s->g->leaf_size = other[k].leaf;
        s->g->precision = other[k].precision;
        add_fmm(s, 4, 3e-4, other[k].more);
    }
    s->g->group_size = s->g->leaf_size = 0;
    s->g->precision = PRECISION_AUTO;
}

/* Rms error in shells, each twice as wide as the one before. */
static void add_shells(struct study *s, const char *name)
{
    enum { SHELLS = 24, FEWEST = 20 };
    double sum[SHELLS] = {0}, rows[SHELLS] = {0};
    for_species(s->sim, t)
        for (int64_t i = 0; i < s->reference.n[t->kind]; i++) {
            int32_t row = s->reference.row[t->kind][i];
            const double *x = t->pos[row];
            double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
            double error = gravity_relative_error(t->acc[row], s->reference.exact[t->kind][i]);
            int shell = (int)fmin(fmax(SHELLS / 2 + floor(0.5 * log2(r2)), 0), SHELLS - 1);
            sum[shell] += error * error;
            rows[shell]++;
        }
    for (int k = 0; k < SHELLS; k++)
        if (rows[k] >= FEWEST)
            chart_row(s->sheet, "%s shells,%lld,%s,%s,,,,,,,,%.3e,,,,,%.4g", s->set,
                      (long long)s->n, name, name, sqrt(sum[k] / rows[k]), ldexp(M_SQRT2, k - SHELLS / 2));
}

/* As a run does it: settings by the accuracy asked, held to it by a self-check at the first force. */
static void sweep_accuracy(struct study *s, const struct chart_gravity *c)
{
    s->g->solver = SOLVER_FMM;
    s->g->order = 0;
    s->g->tolerance = NAN;
    for (int k = 0; k < c->accuracy.n; k++) {
        char name[64];
        snprintf(name, sizeof name, "accuracy %g", c->accuracy.value[k]);
        s->g->accuracy = c->accuracy.value[k];
        s->g->scale = 1;
        s->g->checked = s->g->refined = 0;
        s->sim->tree.leaf_size = 0;
        gravity_configure(s->sim, s->g);
        gravity_force(s->sim);
        snprintf(name, sizeof name, " by accuracy %g", c->accuracy.value[k]);
        add_setting(s, name);
        add_shells(s, name + 4);
    }
    s->g->scale = 1;
}

static void study_set(struct chart_sheet *sheet, const struct chart_gravity *c, const char *set, const char *file)
{
    log_silence(true);
    struct study s = study_begin(sheet, c, set, file);
    log_silence(false);
    sweep_fmm(&s, c);
    sweep_tree(&s, c);
    sweep_sizes(&s);
    sweep_accuracy(&s, c);
    gravity_reference_free(&s.reference);
    sim_free(s.sim);
    char *shells = mem_format("charts", "%s shells", set);
    const char *const error[] = {"rms", "p99", "max"};
    for (int k = 0; k < 3; k++) {
        if (k != 1 && strcmp(set, "plummer") != 0) continue;
        char *title = mem_format("charts", "%s, N = %lld: %s error", set, (long long)s.n, error[k]);
        chart_panel(sheet, &(struct chart_panel){.title = title, .x = "cpu", .y = error[k], .series = "method", .where = "set",
                                                 .is = set, .lines = true, .front = true});
        mem_free(title);
    }
    chart_panel(sheet, &(struct chart_panel){.title = shells, .x = "radius", .y = "rms", .series = "method", .where = "set",
                                             .is = shells, .lines = true});
    mem_free(shells);
}

/* The set bears the file's name without folder and suffix. */
static void study_file(struct chart_sheet *sheet, const struct chart_gravity *c)
{
    const char *slash = strrchr(c->file, '/'), *base = slash ? slash + 1 : c->file, *dot = strrchr(base, '.');
    char *set = mem_format("charts", "%.*s", (int)(dot ? dot - base : (long)strlen(base)), base);
    study_set(sheet, c, set, c->file);
    mem_free(set);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_gravity *c = state;
    chart_columns(sheet, "set,n,row,method,order,opening,group,leaf,precision,tree [s],cpu [s],rms,median,p99,max,held,radius");
    chart_note(sheet, "cited rows: one core of another processor with AVX-512, which does 1e9 pairs in double in 1.65 s");
    chart_note(sheet, "cpu: one force of all rows with the tree; errors: of accelerations against direct sums in double, relative");
    chart_note(sheet, "held: the 99th percentile as gravity.accuracy counts it, against the larger of the acceleration "
                      "and %g of the rms one", GRAVITY_FLOOR);
    if (c->n == 1000000 && (c->set == 0 || c->set == SETS)) add_peers(sheet);
    for (int k = 0; k < SETS; k++)
        if (c->set == k || c->set == SETS) study_set(sheet, c, sets[k], NULL);
    if (c->file) study_file(sheet, c);
}

const struct chart gravity_chart = {"gravity", "errors of forces against CPU time, by solver and setting", params,
                                    sizeof(struct chart_gravity), make};
