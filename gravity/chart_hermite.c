/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart hermite`: the error of the energy of a star cluster against the time it took, by order, eta and
 * iterations (the slides' "4th vs. 6th"), and the blocks of rows that step together. */
#include "draw/chart.h"
#include "gravity.h"
#include "mem.h"
#include "output.h"
#include <math.h>
#include <stdio.h>

enum { IN_DOUBLES, IN_FLOATS, IN_BOTH };

/* One run. */
struct setting { int64_t n, iterations; int order; bool floats; double eta; };

struct chart_hermite {
    double end, softening;
    int precision;
    struct param_list n, orders, iterations, eta4, eta6, eta8;
};

static const struct param params[] = {
    {"n", PARAM_LIST, "", "1000, 4000", 2, 1e7, NULL, "stars", false, offsetof(struct chart_hermite, n)},
    {"end", PARAM_REAL, "", "1", 1e-3, 1e3, NULL, "time at which a run ends, in N-body units", false,
     offsetof(struct chart_hermite, end)},
    {"softening", PARAM_REAL, "", "1e-4", 0, 1, NULL, "softening of a star", false, offsetof(struct chart_hermite, softening)},
    {"orders", PARAM_LIST, "", "4, 6, 8", 4, 8, NULL, "which schemes", false, offsetof(struct chart_hermite, orders)},
    {"iterations", PARAM_LIST, "", "1, 2", 1, 10, NULL, "n of P(EC)^n", false, offsetof(struct chart_hermite, iterations)},
    {"precision", PARAM_CHOICE, "", "double", 0, 0, "double|float|both", "of pairs, for orders 4 and 6", false,
     offsetof(struct chart_hermite, precision)},
    {"eta4", PARAM_LIST, "", "0.0025, 0.005, 0.01, 0.02, 0.04, 0.08", 1e-6, 10, NULL, "eta of order 4", false,
     offsetof(struct chart_hermite, eta4)},
    {"eta6", PARAM_LIST, "", "0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 1", 1e-6, 10, NULL, "eta of order 6", false,
     offsetof(struct chart_hermite, eta6)},
    {"eta8", PARAM_LIST, "", "0.3, 0.4, 0.5, 0.6, 0.75, 1", 1e-6, 10, NULL, "eta of order 8", false,
     offsetof(struct chart_hermite, eta8)},
    {0}
};

static void measure(struct chart_sheet *sheet, const struct chart_hermite *chart, const struct setting *run)
{
    const int64_t n = run->n, iterations = run->iterations;
    char text[5][96];
    snprintf(text[0], sizeof text[0], "time.integrator=hermite%d", run->order);
    snprintf(text[1], sizeof text[1], "hermite%d={eta: %.9g, iterations: %d%s}", run->order, run->eta, (int)iterations,
             run->floats ? ", precision: float" : "");
    snprintf(text[2], sizeof text[2], "start.n=%lld", (long long)n);
    snprintf(text[3], sizeof text[3], "time.end=%.9g", chart->end);
    snprintf(text[4], sizeof text[4], "gravity.softening=%.9g", chart->softening);
    const char *set[] = {text[0], text[1], text[2], text[3], text[4], "output.energy_limit=1e300", NULL};
    double cpu = INFINITY, updates = NAN, steps = NAN, last = NAN, largest = NAN;
    for (int64_t k = 0; k < chart_repeats(sheet); k++) {
        struct sim *sim = chart_sim("ics/cluster.yml", set);
        const struct output *output = sim_state(sim, "output");
        double spent = chart_run(sim);
        cpu = fmin(cpu, spent);
        updates = (double)sim->updates;
        steps = (double)sim->steps;
        last = isnan(spent) ? NAN : fabs(output->energy.error);
        largest = isnan(spent) ? NAN : output->energy.worst;
        sim_free(sim);
    }
    chart_row(sheet, "n = %lld,%lld,order %d%s%s,%g,%lld,%.6g,%.6g,%.6g,%.3e,%.3e,%.4f,%.4g", (long long)n, (long long)n,
              run->order, run->floats ? " floats" : "", iterations > 1 ? " iterated" : "", run->eta, (long long)iterations, steps,
              updates / (double)n, updates / steps, last, largest, cpu, (double)iterations * updates * (double)n / cpu);
}

static const struct param_list *etas(const struct chart_hermite *chart, int order)
{
    return order == 4 ? &chart->eta4 : order == 6 ? &chart->eta6 : &chart->eta8;
}

static const char columns[] = "set,n,scheme,eta,iterations,steps,updates_per_row,mean_block,last_error,largest_error,cpu [s],"
                              "pairs_per_cpu_s";

/* Every order, precision, number of iterations and eta of a set. */
static void measure_set(struct chart_sheet *sheet, const struct chart_hermite *chart, int64_t n)
{
    for (int o = 0; o < chart->orders.n; o++) {
        const int order = (int)chart->orders.value[o], some = chart->precision == IN_FLOATS && order <= 6;
        const int end = chart->precision == IN_DOUBLES || order > 6 ? 1 : 2;
        const struct param_list *eta = etas(chart, order);
        for (int floats = some; floats < end; floats++)
            for (int i = 0; i < chart->iterations.n; i++)
                for (int e = 0; e < eta->n; e++)
                    measure(sheet, chart, &(struct setting){n, (int64_t)chart->iterations.value[i], order, floats, eta->value[e]});
    }
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_hermite *chart = state;
    chart_columns(sheet, columns);
    chart_note(sheet, "Plummer's sphere, G = M = 1, E = -1/4; errors: |E - E(0)|/|E(0)|; a pair: all derivatives of the order");
    for (int a = 0; a < chart->n.n; a++) {
        char name[64];
        measure_set(sheet, chart, (int64_t)chart->n.value[a]);
        snprintf(name, sizeof name, "n = %lld", (long long)chart->n.value[a]);
        chart_panel(sheet, &(struct chart_panel){.title = name, .x = "cpu", .y = "largest_error", .series = "scheme",
                                                 .where = "set", .is = name, .lines = true, .front = true});
    }
    if (chart->n.n > 1)
        chart_panel(sheet, &(struct chart_panel){.title = "rows that step together", .x = "n", .y = "mean_block",
                                                 .series = "scheme"});
}

const struct chart hermite_chart = {"hermite", "energy error of a star cluster against CPU time, by order, eta and iterations",
                                    params, sizeof(struct chart_hermite), make};
