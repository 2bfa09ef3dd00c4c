/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart cooling`: error against CPU time of ways to integrate du/dt = heating - rho Q(u) over one step, from
 * short steps to a hundred cooling times: the program's own, explicit sub-steps that change u by a part at most, and a
 * backward Euler step whose root is found by bisection. */
#include "cooling_curve.h"
#include "data.h"
#include "draw/chart.h"
#include "mem.h"
#include "profile.h"
#include "random.h"
#include <math.h>

struct chart_cooling { int64_t n; double heating, density; struct param_list step, part; };

static const struct param params[] = {
    {"n", PARAM_COUNT, "", "1000", 1, 1e9, NULL, "rows, of random temperature between 1.6e4 and 1.6e8 K", false,
     offsetof(struct chart_cooling, n)},
    {"step", PARAM_LIST, "", "1e-3, 1e-2, 0.1, 1, 10, 100", 1e-9, 1e6, NULL, "length of the step in cooling times", false,
     offsetof(struct chart_cooling, step)},
    {"part", PARAM_LIST, "", "0.1, 0.01", 1e-5, 0.5, NULL, "of u, by which a sub-step changes it at most", false,
     offsetof(struct chart_cooling, part)},
    {"density", PARAM_REAL, "", "2.3e-24", 1e-40, 1, NULL, "of the gas [g cm^-3]", false,
     offsetof(struct chart_cooling, density)},
    {"heating", PARAM_REAL, "", "1", 0, 1e6, NULL, "of the heated gas in units of 2e-26 erg/s a hydrogen nucleus", false,
     offsetof(struct chart_cooling, heating)},
    {0}
};

/* --- ways --- */

struct gas { const struct cooling_curve *curve; double rho, part; };

static double exact(const struct gas *gas, double u, double dt)
{
    return cooling_curve_advance(gas->curve, u, gas->rho, dt);
}

static double sub_steps(const struct gas *gas, double u, double dt)
{
    const double floor = gas->curve->node[0].u;
    while (dt > 0 && u >= floor) {
        double rate = cooling_curve_rate(gas->curve, u, gas->rho), step = fmin(dt, gas->part * u / fabs(rate));
        u += rate * step;
        dt -= step;
    }
    return fmax(u, floor);
}

static double backward(const struct gas *gas, double u, double dt)
{
    enum { HALVINGS = 40 };
    double low = log(gas->curve->node[0].u), high = log(u);
    for (int k = 0; k < HALVINGS; k++) {
        double middle = 0.5 * (low + high), end = exp(middle);
        if (end - cooling_curve_rate(gas->curve, end, gas->rho) * dt > u) high = middle;
        else low = middle;
    }
    return exp(0.5 * (low + high));
}

/* What errors are counted from: midpoint steps of a thousandth, also of the distance from where the gas ends. */
static double reference(const struct gas *gas, double u, double dt)
{
    const double home = cooling_curve_advance(gas->curve, u, gas->rho, 1e40), small = 1e-3;
    while (dt > 0 && fabs(u / home - 1) > 1e-6) {
        double rate = cooling_curve_rate(gas->curve, u, gas->rho);
        double step = fmin(dt, small * fmin(u, fabs(u - home)) / fabs(rate));
        u += step * cooling_curve_rate(gas->curve, u + 0.5 * step * rate, gas->rho);
        dt -= step;
    }
    return dt > 0 ? home : u;
}

/* --- the chart --- */

typedef double way(const struct gas *gas, double u, double dt);

/* Steps of many rows: where they begin, how long they last, where they end. */
struct rows { int64_t n; double *u, *dt, *end; };

static void measure(struct chart_sheet *sheet, const struct gas *gas, const struct rows *rows, double ratio,
                    const char *name, way *integrate)
{
    const char *kind = gas->curve->heating > 0 ? "heated" : "cooling";
    double best = INFINITY, sum = 0, largest = 0;
    for (int64_t k = 0; k < chart_repeats(sheet); k++) {
        double began = profile_cpu(), check_sum = 0;
        for (int64_t i = 0; i < rows->n; i++) check_sum += integrate(gas, rows->u[i], rows->dt[i]);
        best = fmin(best, isfinite(check_sum) ? profile_cpu() - began : NAN);
    }
    for (int64_t i = 0; i < rows->n; i++) {
        double error = fabs(log(integrate(gas, rows->u[i], rows->dt[i]) / rows->end[i]));
        sum += error / (double)rows->n;
        largest = fmax(largest, error);
    }
    chart_row(sheet, "%s,%s,%g,%.1f,%.3e,%.3e", kind, name, ratio, 1e9 * best / (double)rows->n, sum, largest);
}

static void compare(struct chart_sheet *sheet, const struct chart_cooling *chart, const struct cooling_curve *curve)
{
    struct gas gas = {curve, chart->density, 0};
    struct rows rows = {chart->n, mem_array("charts", double, chart->n), mem_array("charts", double, chart->n),
                        mem_array("charts", double, chart->n)};
    for (int s = 0; s < chart->step.n; s++) {
        double ratio = chart->step.value[s];
        for (int64_t i = 0; i < rows.n; i++) {
            const struct random key = {0, (uint64_t)i, 0, random_stream("chart_cooling")};
            rows.u[i] = cooling_curve_u(curve, pow(10, 4.2 + 4 * random_uniform(&key, 0)));
            rows.dt[i] = ratio * rows.u[i] / fabs(cooling_curve_rate(curve, rows.u[i], gas.rho));
            rows.end[i] = reference(&gas, rows.u[i], rows.dt[i]);
        }
        measure(sheet, &gas, &rows, ratio, "exact", exact);
        for (int p = 0; p < chart->part.n; p++) {
            char name[64];
            snprintf(name, sizeof name, "sub-steps %g", gas.part = chart->part.value[p]);
            measure(sheet, &gas, &rows, ratio, name, sub_steps);
        }
        measure(sheet, &gas, &rows, ratio, "backward Euler", backward);
    }
    mem_free(rows.u);
    mem_free(rows.dt);
    mem_free(rows.end);
}

typedef void sampler(const struct cooling_table *table, double feh, struct cooling_samples *samples);

static void compare_gas(struct chart_sheet *sheet, const struct chart_cooling *chart, sampler *sample,
                        const struct cooling_gas *gas)
{
    struct problems problems = {0};
    char *path = data_path("cooling_tables/sutherland_dopita_1993.txt");
    struct cooling_table *table = cooling_table_read(path, &problems);
    problems_report(&problems);
    struct cooling_samples *samples = mem_alloc("charts", sizeof *samples);
    sample(table, 0, samples);
    struct cooling_curve *curve = cooling_curve_new(samples, gas);
    compare(sheet, chart, curve);
    cooling_curve_free(curve);
    mem_free(samples);
    cooling_table_free(table);
    mem_free(path);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_cooling *chart = state;
    const char *const kinds[] = {"cooling", "heated"};
    chart_columns(sheet, "gas,way,step,cpu [ns],mean_error,largest_error");
    chart_note(sheet, "errors: of ln u after one step; cpu: of a row and step; solar, floors 1e4 K (cooling) and 10 K (heated)");
    compare_gas(sheet, chart, cooling_table_sample, &(struct cooling_gas){5.0 / 3, NAN, NAN, 1e4, 0});
    if (chart->heating > 0)
        compare_gas(sheet, chart, cooling_table_sample_koyama,
                    &(struct cooling_gas){5.0 / 3, NAN, NAN, 10, chart->heating * COOLING_KOYAMA_HEATING});
    for (int k = 0; k < (chart->heating > 0 ? 2 : 1); k++) {
        chart_panel(sheet, &(struct chart_panel){.title = kinds[k], .x = "cpu", .y = "mean_error", .series = "way",
                                                 .where = "gas", .is = kinds[k], .lines = true, .front = true});
        chart_panel(sheet, &(struct chart_panel){.title = kinds[k], .x = "step", .y = "cpu", .series = "way",
                                                 .where = "gas", .is = kinds[k], .lines = true});
    }
}

const struct chart cooling_chart = {"cooling", "error of a cooling step against CPU time, by method and length of the step",
                                    params, sizeof(struct chart_cooling), make};
