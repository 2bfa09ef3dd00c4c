/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart time`: the error of the energy against the forces it took, for each integrator with
 * steps of their own or common ones, on scenes that are hard on an integrator. */
#include "draw/chart.h"
#include "mem.h"
#include "output.h"
#include <math.h>
#include <stdio.h>

struct chart_time {
    int64_t n_collapse, n_evrard;
    double orbits, end_collapse, end_evrard;
    struct param_list eccentricity, time_step, courant;
};

static const struct param params[] = {
    {"eccentricity", PARAM_LIST, "", "0.5, 0.9", 0, 0.999, NULL, "of Kepler's orbits", false,
     offsetof(struct chart_time, eccentricity)},
    {"orbits", PARAM_REAL, "", "10", 0.1, 1e6, NULL, "how many times round", false, offsetof(struct chart_time, orbits)},
    {"n_collapse", PARAM_COUNT, "", "1000", 0, 1e9, NULL, "particles of the cold collapse; 0 leaves it out", false,
     offsetof(struct chart_time, n_collapse)},
    {"end_collapse", PARAM_REAL, "", "2", 0.01, 1e3, NULL, "time at which it ends", false,
     offsetof(struct chart_time, end_collapse)},
    {"n_evrard", PARAM_COUNT, "", "4000", 0, 1e9, NULL, "particles of Evrard's collapse; 0 leaves it out", false,
     offsetof(struct chart_time, n_evrard)},
    {"end_evrard", PARAM_REAL, "", "1.6", 0.01, 1e3, NULL, "time at which it ends", false,
     offsetof(struct chart_time, end_evrard)},
    {"time_step", PARAM_LIST, "", "0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8", 1e-4, 10, NULL,
     "gravity.time_step of the collapse; ten times that on orbits", false, offsetof(struct chart_time, time_step)},
    {"courant", PARAM_LIST, "", "0.075, 0.15, 0.3, 0.6, 1.2", 1e-3, 2, NULL,
     "sph.courant of Evrard's collapse; sph.acceleration is 5/6 of it", false, offsetof(struct chart_time, courant)},
    {0}
};

struct scheme { const char *name, *integrator; int evaluations; const char *steps; };
static const struct scheme schemes[] = {
    {"leapfrog", "leapfrog", 1, "individual"}, {"leapfrog common", "leapfrog", 1, "common"},
    {"pec", "pec", 1, "individual"}, {"pec common", "pec", 1, "common"},
    {"pec twice", "pec", 2, "individual"}, {"pec twice common", "pec", 2, "common"},
};
enum { SCHEMES = sizeof schemes / sizeof *schemes };

/* One scene and one knob that scales its steps. */
struct problem { const char *name, *scene, *settings[5], *knob; double value; };

/* The least CPU time, and forces a row and energy errors, which repeats do not change. */
static void measure(struct chart_sheet *sheet, const struct problem *problem, const struct scheme *scheme)
{
    char text[3][64];
    snprintf(text[0], sizeof text[0], "time.integrator=%s", scheme->integrator);
    snprintf(text[1], sizeof text[1], "time.evaluations=%d", scheme->evaluations);
    snprintf(text[2], sizeof text[2], "time.steps=%s", scheme->steps);
    const char *set[10] = {text[0], text[1], text[2], "output.energy_limit=1e300"};
    for (int k = 0; k < 5 && problem->settings[k]; k++) set[4 + k] = problem->settings[k];
    double cpu = INFINITY, forces = NAN, last = NAN, largest = NAN;
    for (int64_t k = 0; k < chart_repeats(sheet); k++) {
        struct sim *sim = chart_sim(problem->scene, set);
        const struct output *output = sim_state(sim, "output");
        int64_t rows = 0;
        for_species(sim, s) rows += s->n;
        double spent = chart_run(sim);
        cpu = fmin(cpu, spent);
        forces = (double)(sim->updates * scheme->evaluations) / (double)rows;
        last = isnan(spent) ? NAN : fabs(output->energy.error);
        largest = isnan(spent) ? NAN : output->energy.worst;
        sim_free(sim);
    }
    chart_row(sheet, "%s,%s,%s,%g,%.6g,%.3e,%.3e,%.4f", problem->name, scheme->name, problem->knob, problem->value, forces,
              last, largest, cpu);
}

static void sweep(struct chart_sheet *sheet, struct problem problem, const struct param_list *values, double factor)
{
    char knob[64], second[64];
    const bool orbit = factor > 1;
    int at = 0;
    while (problem.settings[at]) at++;
    for (int s = 0; s < SCHEMES; s += orbit ? 2 : 1)    /* two bodies have one step anyway */
        for (int k = 0; k < values->n; k++) {
            problem.value = factor * values->value[k];
            snprintf(knob, sizeof knob, "%s=%.9g", problem.knob, problem.value);
            snprintf(second, sizeof second, "sph.acceleration=%.9g", 5.0 / 6 * problem.value);
            problem.settings[at] = knob;
            if (problem.knob[0] == 's') problem.settings[at + 1] = second;
            measure(sheet, &problem, &schemes[s]);
        }
}

static void add_panel(struct chart_sheet *sheet, const char *problem)
{
    chart_panel(sheet, &(struct chart_panel){.title = problem, .x = "forces_per_row", .y = "largest_error", .series = "scheme",
                                             .where = "problem", .is = problem, .lines = true, .front = true});
}

static void sweep_orbits(struct chart_sheet *sheet, const struct chart_time *chart)
{
    for (int k = 0; k < chart->eccentricity.n; k++) {
        char name[64], eccentricity[64], end[64];
        snprintf(name, sizeof name, "kepler e = %g", chart->eccentricity.value[k]);
        snprintf(eccentricity, sizeof eccentricity, "start.eccentricity=%.9g", chart->eccentricity.value[k]);
        snprintf(end, sizeof end, "time.end=%.15g", 2 * M_PI * chart->orbits);
        sweep(sheet, (struct problem){name, "ics/kepler.yml", {eccentricity, end}, "gravity.time_step", 0},
              &chart->time_step, 10);
        add_panel(sheet, name);
    }
}

static void sweep_collapse(struct chart_sheet *sheet, const struct chart_time *chart)
{
    char n[64], end[64];
    snprintf(n, sizeof n, "start.n=%lld", (long long)chart->n_collapse);
    snprintf(end, sizeof end, "time.end=%.9g", chart->end_collapse);
    sweep(sheet, (struct problem){"cold collapse", "ics/cold_collapse.yml", {n, end, "gravity.solver=direct"},
                                  "gravity.time_step", 0}, &chart->time_step, 1);
    add_panel(sheet, "cold collapse");
}

static void sweep_evrard(struct chart_sheet *sheet, const struct chart_time *chart)
{
    char n[64], end[64];
    snprintf(n, sizeof n, "start.n=%lld", (long long)chart->n_evrard);
    snprintf(end, sizeof end, "time.end=%.9g", chart->end_evrard);
    sweep(sheet, (struct problem){"Evrard", "ics/evrard.yml", {n, end}, "sph.courant", 0}, &chart->courant, 1);
    add_panel(sheet, "Evrard");
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_time *chart = state;
    chart_columns(sheet, "problem,scheme,knob,value,forces_per_row,last_error,largest_error,cpu [s]");
    chart_note(sheet, "errors: |E - E(0)|/|E(0)| at full synchronisations; forces: of all rows, over their number");
    sweep_orbits(sheet, chart);
    if (chart->n_collapse > 0) sweep_collapse(sheet, chart);
    if (chart->n_evrard > 0) sweep_evrard(sheet, chart);
}

const struct chart time_chart = {"time", "error of the energy against forces and CPU time, by integrator and steps", params,
                                 sizeof(struct chart_time), make};
