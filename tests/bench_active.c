/* SPDX-License-Identifier: GPL-3.0-or-later
 * CPU time of gravity in a step of which few rows are active: refitting of the tree and the cells, nanoseconds a row of
 * the set; walk and evaluation, microseconds an active row. Active rows lie next to each other in key order (a dense
 * part), or apart, by turns. And what potentials add to a force of all rows. Usage: bench_active [N [ACCURACY]]. A Plummer sphere, eps = 0.01. */
#include "draw/chart.h"
#include "gravity/gravity.h"
#include "log.h"
#include "module.h"
#include "profile.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Every `stride`-th row from `first` on ends its step at each tick, the others never do. */
static void wake(struct species *s, int64_t first, int64_t n, int64_t stride)
{
    for (int64_t i = 0; i < s->n; i++) s->rung[i] = s->rung0[i] = RUNG_TOP;
    for (int64_t k = 0; k < n; k++) s->rung[first + k * stride] = s->rung0[first + k * stride] = 0;
}

static void measure(struct sim *sim, const char *name, int64_t first, int64_t n, int64_t stride)
{
    enum { REPEATS = 7 };
    double refit = INFINITY, walk = INFINITY;
    wake(&sim->species[DARK], first, n, stride);
    for (int k = 0; k < REPEATS; k++) {
        sim->time.tick++;
        sim->unsorted = 0;      /* no rebuild */
        sim_find_active(sim);
        const double begun = profile_cpu();
        sim_run_hook(sim, HOOK_ARRANGE);
        const double arranged = profile_cpu();
        sim_run_hook(sim, HOOK_FORCE);
        refit = fmin(refit, arranged - begun);
        walk = fmin(walk, profile_cpu() - arranged);
    }
    printf("%-5s %8lld active: refit %6.2f ns a row of the set, walk and evaluation %7.2f microseconds an active row\n", name,
           (long long)n, 1e9 * refit / (double)sim->species[DARK].n, 1e6 * walk / (double)n);
}

/* Forces of all rows, with and without potentials by turns. */
static void measure_potential(struct sim *sim)
{
    enum { REPEATS = 7 };
    double least[2] = {INFINITY, INFINITY};
    for (int k = 0; k < 2 * REPEATS; k++) {
        sim->want_potential = k % 2;
        const struct gravity_cost cost = gravity_force(sim);
        least[k % 2] = fmin(least[k % 2], cost.build + cost.walk);
    }
    sim->want_potential = false;
    printf("all active: %.3f microseconds a row, with potentials %.3f (%+.1f %%)\n", 1e6 * least[0] / (double)sim->species[DARK].n,
           1e6 * least[1] / (double)sim->species[DARK].n, 100 * (least[1] / least[0] - 1));
}

int main(int argc, char **argv)
{
    char n[64], accuracy[64];
    snprintf(n, sizeof n, "start.n=%s", argc > 1 ? argv[1] : "100000");
    snprintf(accuracy, sizeof accuracy, "gravity.accuracy=%s", argc > 2 ? argv[2] : "1e-3");
    const char *const set[] = {"units={G: 1}", "start={generator: plummer}", n, "time={end: 1}", "output={snapshot_every: 1}",
                               "gravity={solver: fmm}", "gravity.softening=0.01", accuracy, NULL};
    log_silence(true);
    struct sim *sim = chart_sim(NULL, set);
    for (int k = 0; k < 2; k++) gravity_force(sim);     /* the first learns the accelerations */
    log_silence(false);
    measure_potential(sim);
    const int64_t rows = sim->species[DARK].n;
    for (int64_t active = 1; active < rows; active *= 10) {
        measure(sim, "dense", rows / 2, active < rows / 2 ? active : rows / 2, 1);
        measure(sim, "apart", 0, active, rows / active);
    }
    sim_free(sim);
    return 0;
}
