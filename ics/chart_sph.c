/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart sph`: L1 error of density, velocity and pressure against CPU time on flows that are known
 * exactly (exact.h), one setting of the gas changed at a time. L1 is the mean of |found - exact| over the
 * gas' volume, in parts of the largest exact value; of the wave, of its perturbation. */
#include "draw/chart.h"
#include "exact.h"
#include "mem.h"
#include "output.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VARIABLES = 3 };     /* density, velocity, pressure */

struct chart_sph {
    int64_t n[4];
    struct param_list refine, neighbours, courant, acceleration, alpha;
    char *variants;
};

#define ROWS(name, k, n_, text) \
    {"n_" name, PARAM_COUNT, "", n_, 0, 1e9, NULL, "particles of " text "; 0 leaves it out", false, \
     offsetof(struct chart_sph, n) + k * sizeof(int64_t)}
static const struct param params[] = {
    ROWS("sod", 0, "4000", "Sod's tube"),
    ROWS("sedov", 1, "4096", "Sedov's explosion"),
    ROWS("noh", 2, "4000", "Noh's implosion"),
    ROWS("wave", 3, "1000", "the sound wave"),
    {"refine", PARAM_LIST, "", "0.125, 1, 8", 1e-3, 1e3, NULL, "times these numbers of particles", false,
     offsetof(struct chart_sph, refine)},
    {"neighbours", PARAM_LIST, "", "30, 40, 50, 54, 64", 4, 1000, NULL, "sph.neighbours", false,
     offsetof(struct chart_sph, neighbours)},
    {"courant", PARAM_LIST, "", "0.1, 0.2, 0.3, 0.4, 0.6, 0.8", 1e-3, 2, NULL, "sph.courant", false,
     offsetof(struct chart_sph, courant)},
    {"acceleration", PARAM_LIST, "", "0.1, 0.25, 0.6", 1e-3, 2, NULL, "sph.acceleration", false,
     offsetof(struct chart_sph, acceleration)},
    {"alpha", PARAM_LIST, "", "0.25, 0.5, 1, 1.5", 0, 100, NULL, "sph.alpha; sph.beta is twice that", false,
     offsetof(struct chart_sph, alpha)},
    {"variants", PARAM_TEXT, "",
     "preset=modern preset=modern+alpha=0.25 preset=modern+alpha=0.75 preset=modern+alpha=1+alpha_min=0 preset=modern+beta=1 "
     "preset=modern+beta=1.5 preset=modern+beta=3 preset=modern+alpha_min=0 preset=modern+alpha_min=0.2 conduction=0.1 "
     "balsara=off count=smooth viscosity=signal count=smooth+grad_h=on "
     "count=smooth+grad_h=on+equation=entropy kernel=wendland_c2+neighbours=100 kernel=wendland_c4+neighbours=150", 0, 0, NULL,
     "keys of sph with their values, a blank between variants, + between keys of one", false,
     offsetof(struct chart_sph, variants)},
    {0}
};

/* Where a row is and what is true there. False: the row is not compared. */
struct flow { double t, gamma; struct exact_riemann riemann; struct exact_sedov sedov; double kernel; };
struct point { struct exact_state found, exact; double volume; };

struct problem {
    const char *name, *scene;
    bool (*compare)(const struct flow *flow, const double pos[3], const double vel[3], struct point *point);
};

static const double amplitude = 1e-3;       /* of ics/wave.yml */

static double radial(const double pos[3], const double vel[3], double centre, double *v)
{
    double r2 = 0, rv = 0;
    for (int k = 0; k < 3; k++) {
        r2 += (pos[k] - centre) * (pos[k] - centre);
        rv += (pos[k] - centre) * vel[k];
    }
    double r = fmax(sqrt(r2), 1e-12);
    *v = rv / r;
    return r;
}

/* The second, mirrored tube begins where the box closes on itself. */
static bool compare_sod(const struct flow *flow, const double pos[3], const double vel[3], struct point *point)
{
    point->found.v = vel[0];
    point->exact = exact_riemann_at(&flow->riemann, (pos[0] - 1) / flow->t);
    return fabs(pos[0] - 1) < 0.5;
}

static bool compare_sedov(const struct flow *flow, const double pos[3], const double vel[3], struct point *point)
{
    const double radius = flow->sedov.constant * pow(flow->t, 0.4), speed = radius / flow->t;
    double r = radial(pos, vel, 0.5, &point->found.v);
    struct exact_state s = exact_sedov_at(&flow->sedov, r / radius);
    point->exact = (struct exact_state){s.rho, s.v * speed, s.p * speed * speed};
    return r < 0.5;
}

static bool compare_noh(const struct flow *flow, const double pos[3], const double vel[3], struct point *point)
{
    double r = radial(pos, vel, 0, &point->found.v);
    point->exact = exact_noh(flow->gamma, r, flow->t);
    return r < 0.35;
}

/* The perturbation: a lattice's density has a constant error of its own. */
static bool compare_wave(const struct flow *flow, const double pos[3], const double vel[3], struct point *point)
{
    struct exact_state s = exact_wave(flow->gamma, amplitude, pos[0], flow->t);
    point->found = (struct exact_state){point->found.rho / flow->kernel - 1, vel[0],
                                        point->found.p / flow->kernel - 1 / flow->gamma};
    point->exact = (struct exact_state){s.rho - 1, s.v, s.p - 1 / flow->gamma};
    return true;
}

static const struct problem problems[] = {
    {"Sod", "ics/sod.yml", compare_sod}, {"Sedov", "ics/sedov.yml", compare_sedov},
    {"Noh", "ics/noh.yml", compare_noh}, {"wave", "ics/wave.yml", compare_wave},
};
enum { PROBLEMS = sizeof problems / sizeof *problems };

static struct flow flow_of(const struct sim *sim)
{
    const struct species *gas = &sim->species[GAS];
    struct flow flow = {.t = timeline_now(&sim->time), .gamma = sim_real(sim, "gamma", NAN)};
    flow.riemann = exact_riemann(flow.gamma, (struct exact_state){1, 0, 1}, (struct exact_state){0.125, 0, 0.1});
    flow.sedov = exact_sedov(flow.gamma);
    for (int64_t i = 0; i < gas->n; i++)
        flow.kernel += (double)gas->rho[i] / exact_wave(flow.gamma, amplitude, gas->pos[i][0], flow.t).rho / (double)gas->n;
    return flow;
}

static void errors(const struct sim *sim, const struct problem *problem, double l1[VARIABLES])
{
    const struct species *gas = &sim->species[GAS];
    const struct flow flow = flow_of(sim);
    double volume = 0, largest[VARIABLES] = {0};
    memset(l1, 0, VARIABLES * sizeof *l1);
    for (int64_t i = 0; i < gas->n; i++) {
        double rho = (double)gas->rho[i];
        struct point point = {.found = {rho, 0, (flow.gamma - 1) * rho * (double)gas->u[i]}, .volume = gas->mass[i] / rho};
        if (!problem->compare(&flow, gas->pos[i], gas->vel[i], &point)) continue;
        const double found[VARIABLES] = {point.found.rho, point.found.v, point.found.p};
        const double exact[VARIABLES] = {point.exact.rho, point.exact.v, point.exact.p};
        volume += point.volume;
        for (int k = 0; k < VARIABLES; k++) {
            l1[k] += point.volume * fabs(found[k] - exact[k]);
            largest[k] = fmax(largest[k], fabs(exact[k]));
        }
    }
    for (int k = 0; k < VARIABLES; k++) l1[k] /= volume * largest[k];
}

/* One run of a problem with n rows and a setting: "alpha=1+beta=2" becomes two keys of sph. */
static void measure(struct chart_sheet *sheet, const struct problem *problem, int64_t n, const char *knob, const char *value,
                    const char *setting)
{
    enum { KEYS = 8 };
    char *text = mem_format("charts", "%s", setting), *rows = mem_format("charts", "start.n=%lld", (long long)n);
    char *key[KEYS] = {0};
    const char *set[KEYS + 3] = {rows, "output.energy_limit=1e300"};
    int count = 0;
    for (char *next = text, *word; *text && count < KEYS && (word = strsep(&next, "+")); count++)
        set[2 + count] = key[count] = mem_format("charts", "%s%s", strncmp(word, "time.", 5) == 0 ? "" : "sph.", word);
    double cpu = INFINITY, l1[VARIABLES] = {NAN, NAN, NAN}, energy = NAN, updates = NAN;
    for (int64_t k = 0; k < chart_repeats(sheet); k++) {
        struct sim *sim = chart_sim(problem->scene, set);
        double spent = chart_run(sim);
        cpu = fmin(cpu, spent);
        if (k == 0 && !isnan(spent)) {
            errors(sim, problem, l1);
            energy = ((const struct output *)sim_state(sim, "output"))->energy.worst;
            updates = (double)sim->updates / (double)n;
        }
        sim_free(sim);
    }
    chart_row(sheet, "%s,%s,%s,%lld,%.4e,%.4e,%.4e,%.2e,%.1f,%.4f", problem->name, knob, value, (long long)n,
              l1[0], l1[1], l1[2], energy, updates, cpu);
    for (int k = 0; k < count; k++) mem_free(key[k]);
    mem_free(rows);
    mem_free(text);
}

static void sweep(struct chart_sheet *sheet, const struct problem *problem, int64_t n, const char *knob,
                  const struct param_list *list)
{
    for (int k = 0; k < list->n; k++) {
        char value[32], setting[96];
        snprintf(value, sizeof value, "%g", list->value[k]);
        snprintf(setting, sizeof setting, "%s=%s", knob, value);
        if (strcmp(knob, "alpha") == 0) snprintf(setting, sizeof setting, "alpha=%s+beta=%g", value, 2 * list->value[k]);
        measure(sheet, problem, n, knob, value, setting);
    }
}

static void sweep_all(struct chart_sheet *sheet, const struct problem *problem, const struct chart_sph *chart, int64_t n)
{
    for (int k = 0; k < chart->refine.n; k++) {
        char value[32];
        snprintf(value, sizeof value, "%g", chart->refine.value[k]);
        measure(sheet, problem, llround(chart->refine.value[k] * (double)n), "n", value, "");
    }
    sweep(sheet, problem, n, "neighbours", &chart->neighbours);
    sweep(sheet, problem, n, "courant", &chart->courant);
    sweep(sheet, problem, n, "acceleration", &chart->acceleration);
    sweep(sheet, problem, n, "alpha", &chart->alpha);
    measure(sheet, problem, n, "steps", "common", "time.steps=common");
    char *buffer = mem_format("charts", "%s", chart->variants);
    for (char *next = buffer, *word; (word = strsep(&next, " "));)
        if (*word) measure(sheet, problem, n, "variant", word, word);
    mem_free(buffer);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_sph *chart = state;
    chart_columns(sheet, "problem,knob,value,n,L1_density,L1_velocity,L1_pressure,energy_error,updates_per_row,cpu [s]");
    chart_note(sheet, "one setting changed at a time, the others at their defaults; n: times the problem's number of rows");
    for (int p = 0; p < PROBLEMS; p++) {
        if (chart->n[p] == 0) continue;
        sweep_all(sheet, &problems[p], chart, chart->n[p]);
        struct chart_panel panel = {.title = problems[p].name, .x = "cpu", .y = "L1_density", .series = "knob",
                                    .where = "problem", .is = problems[p].name, .lines = true, .front = true};
        chart_panel(sheet, &panel);
        panel.y = "energy_error";
        panel.front = false;
        chart_panel(sheet, &panel);
    }
}

const struct chart sph_chart = {"sph", "L1 error of gas against CPU time on flows known exactly, by setting", params,
                                sizeof(struct chart_sph), make};
