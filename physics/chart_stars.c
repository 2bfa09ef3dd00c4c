/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart stars`: what steps cost and spare where stars form and where they return. `formation`: the energy error of a ball
 * of gas that collapses into stars (doc/manual/star-formation.md), root mean square of several balls. `populations`: thermal
 * energy that gas has left beside stars which age 50 Myr (ics/ssp_box.yml), against steps half as long as the shortest. */
#include "draw/chart.h"
#include "energy.h"
#include "output.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

struct chart_stars { int64_t balls; struct param_list star_step, courant, age_step; };

static const struct param params[] = {
    {"balls", PARAM_COUNT, "", "4", 1, 1000, NULL, "of gas that collapse, which differ a little in their heat", false,
     offsetof(struct chart_stars, balls)},
    {"star_step", PARAM_LIST, "", "0.05, 0.1, 0.2, 10", 1e-3, 10, NULL, "star_formation.time_step (10: holds nobody down)", false,
     offsetof(struct chart_stars, star_step)},
    {"courant", PARAM_LIST, "", "0.1, 0.2, 0.3", 1e-2, 1, NULL, "sph.courant", false, offsetof(struct chart_stars, courant)},
    {"age_step", PARAM_LIST, "", "0.025, 0.05, 0.1, 0.2, 0.4, 1000", 1e-2, 1e3, NULL, "feedback.time_step", false,
     offsetof(struct chart_stars, age_step)},
    {0}
};

enum { TEXT = 128, SETTINGS = 12 };
struct result { double error, thermal, cpu; int64_t updates; };

static struct result run(const char *scene, const char *const *settings)
{
    struct sim *sim = chart_sim(scene, settings);
    const struct output *output = sim_state(sim, "output");
    struct result result = {.cpu = chart_run(sim)};
    result.error = isnan(result.cpu) ? NAN : output->energy.worst;
    result.updates = sim->updates;
    for (int e = 0; e < output->energy.n; e++)
        if (strcmp(output->energy.name[e], "thermal") == 0) result.thermal = output->energy.value[e];
    sim_free(sim);
    return result;
}

/* --- formation --- */

static void measure_balls(struct chart_sheet *sheet, const struct chart_stars *chart, const char *knob, double value)
{
    char set_knob[TEXT], start[TEXT];
    const char *const settings[SETTINGS] = {
        "units={length: kpc, mass: 1e10 Msun, velocity: km/s}", start, "time={end: 0.24, dt_max: 0.01}",
        "output={snapshot_every: 0.01, energy_every: 0.00125}", "gravity={softening: 0.1 kpc, accuracy: 1e-2}", "sph={}",
        "cooling={}", "star_formation={}", set_knob};
    double sum = 0, cpu = 0, updates = 0;
    snprintf(set_knob, sizeof set_knob, strcmp(knob, "time.steps") == 0 ? "%s=common" : "%s=%g", knob, value);
    for (int64_t b = 0; b < chart->balls; b++) {
        snprintf(start, sizeof start, "start={generator: uniform, species: gas, n: 300, mass: 0.1, radius: 5, u: %lld}",
                 1990 + 5 * (long long)b);
        struct result result = run(NULL, settings);
        sum += result.error * result.error / (double)chart->balls;
        cpu += result.cpu / (double)chart->balls;
        updates += (double)result.updates / (double)chart->balls;
    }
    chart_row(sheet, "formation,%s,%g,%.6g,%.3e,%.4f", knob, value, updates, sqrt(sum), cpu);
}

/* --- populations --- */

static struct result run_box(double step)
{
    char set_step[TEXT];
    const char *const settings[] = {"start.n=1010", "time.end=50 Myr", set_step, NULL};
    snprintf(set_step, sizeof set_step, "feedback.time_step=%g", step);
    return run("ics/ssp_box.yml", settings);
}

static void measure_boxes(struct chart_sheet *sheet, const struct param_list *steps)
{
    double shortest = INFINITY;
    for (int k = 0; k < steps->n; k++) shortest = fmin(shortest, steps->value[k]);
    const struct result exact = run_box(shortest / 2);
    for (int k = 0; k < steps->n; k++) {
        struct result best = run_box(steps->value[k]);
        for (int64_t r = 1; r < chart_repeats(sheet); r++) best.cpu = fmin(best.cpu, run_box(steps->value[k]).cpu);
        chart_row(sheet, "populations,feedback.time_step,%g,%lld,%.3e,%.4f", steps->value[k], (long long)best.updates,
                  fabs(best.thermal / exact.thermal - 1), best.cpu);
    }
}

static void make(struct chart_sheet *sheet, const void *state)
{
    static const char *const problems[] = {"formation", "populations"};
    const struct chart_stars *chart = state;
    chart_columns(sheet, "problem,knob,value,updates,error,cpu [s]");
    chart_note(sheet, "formation: largest |E - E(0)|/|E(0)| of a collapse, mean of cpu; "
               "populations: of the thermal energy in the end");
    for (int k = 0; k < chart->star_step.n; k++) measure_balls(sheet, chart, "star_formation.time_step", chart->star_step.value[k]);
    for (int k = 0; k < chart->courant.n; k++) measure_balls(sheet, chart, "sph.courant", chart->courant.value[k]);
    measure_balls(sheet, chart, "time.steps", 0);
    measure_boxes(sheet, &chart->age_step);
    for (int p = 0; p < 2; p++)
        chart_panel(sheet, &(struct chart_panel){.title = problems[p], .x = "cpu", .y = "error", .series = "knob",
                                                 .where = "problem", .is = problems[p], .lines = true, .front = true});
}

const struct chart stars_chart = {"stars", "errors of star formation and of ageing stars against CPU time", params,
                                  sizeof(struct chart_stars), make};
