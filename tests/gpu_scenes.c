/* SPDX-License-Identifier: GPL-3.0-or-later
 * Scenes on the device beside the same on the CPU: one force of all rows hook by hook, then whole steps. What differs
 * between the two is the rounding of floats: cells, groups and neighbours are the same. */
#include "gpu_scenes.h"
#include "device.h"
#include "device_rows.h"
#include "gravity/gravity.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "profile.h"
#include "run.h"
#include "start.h"
#include <math.h>
#include <stdio.h>

/* No larger n on the CPU: it is to take seconds on one core. */
enum { CPU_ROWS = 300000, SETTINGS = 12 };

static const char *const common[] = {"units={G: 1}", "start={}", "time={end: 1}", "output={snapshot_every: 1}", NULL};

struct case_of {
    const char *name;
    const char *settings[SETTINGS];
    bool gas;
    int steps;              /* whole steps to be timed after the forces at the start */
    int most;               /* no more rows than these */
    double bound;           /* of the rms difference of accelerations, relative to their rms size */
};

#define TREE "gravity={solver: tree, order: 2, opening_angle: 0.6, group_size: 64, precision: float, softening: 0.003}"
/* The device's groups look from the root, the CPU's inherit: both err by what is asked. */
#define FMM "gravity={solver: fmm, accuracy: 1e-3, precision: float, softening: 0.003}"
static const struct case_of cases[] = {
    {"plummer-fmm", {"start.generator=plummer", FMM}, false, 0, 10000000, 2e-3},
    {"clumped-fmm", {"start.generator=clumped", FMM}, false, 0, 100000, 2e-3},
    {"plummer-tree", {"start.generator=plummer", TREE}, false, 0, 10000000, 1e-5},
    {"clumped-tree", {"start.generator=clumped", TREE}, false, 0, 100000, 1e-5},
    {"uniform-sph", {"start.generator=uniform", "start.species=gas", "sph={}"}, true, 0, 10000000, 1e-5},
    {"evrard-modern", {"start.generator=evrard", TREE, "sph={preset: modern, count: smooth, grad_h: on, kernel: wendland_c4}"}, true,
     0, 100000, 1e-5},
    {"evrard-pec", {"start.generator=evrard", TREE, "sph={}", "time.integrator=pec"}, true, 3, 1000000, 1e-5},
    {"evrard", {"start.generator=evrard", TREE, "sph={}"}, true, 3, 1000000, 1e-5},
};

static struct sim *case_sim(const struct case_of *c, int n, struct device *device)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    char rows[64];
    snprintf(rows, sizeof rows, "start.n=%d", n);
    for (const char *const *s = common; *s; s++) scene_set(scene, *s, &problems);
    for (int s = 0; s < SETTINGS && c->settings[s]; s++) scene_set(scene, c->settings[s], &problems);
    scene_set(scene, rows, &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    problems_report(&sim->problems);
    sim->device = device;
    sim_begin(sim);
    problems_report(&sim->problems);
    struct gravity *g = sim_state(sim, "gravity");
    if (g) g->checked = 1;      /* errors are another test's: no direct sums on the CPU */
    return sim;
}

/* The device belongs to the caller. */
static void case_end(struct sim *sim)
{
    if (!sim) return;
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->end) sim->use[u].module->end(sim, sim->use[u].state);
    sim->n_call = 0;            /* modules have ended */
    sim->device = NULL;
    sim_free(sim);
}

/* Seconds by the clock of one hook over all rows, the better of two; forces add up, on either side alike. */
static double hook_seconds(struct sim *sim, int hook)
{
    double least = INFINITY;
    for (int k = 0; k < 2 && !sim->failure.set; k++) {
        double began = profile_wall();
        sim_run_hook(sim, hook);
        least = fmin(least, profile_wall() - began);
    }
    return least;
}

/* The same of keys, sort, cells and what modules keep of these; the first call makes room on the device. */
static double arrange_seconds(struct sim *sim)
{
    double least = INFINITY;
    for (int k = 0; k < 2 && !sim->failure.set; k++) {
        sim->rebuild_next = true;
        double began = profile_wall();
        sim_run_hook(sim, HOOK_ARRANGE);
        least = fmin(least, profile_wall() - began);
    }
    return least;
}

/* Root mean square of the differences of accelerations over that of their sizes. The rows are in one order. */
static double difference(const struct sim *a, struct sim *b)
{
    rows_here(b, ALL_SPECIES, COL(acc), 0);
    double sum = 0, square = 0;
    for_species(a, s)
        for (int64_t i = 0; i < s->n; i++)
            for (int k = 0; k < 3; k++) {
                sum += pow((double)s->acc[i][k] - (double)b->species[s->kind].acc[i][k], 2);
                square += pow((double)s->acc[i][k], 2);
            }
    return sqrt(sum / square);
}

static void print_row(const struct case_of *c, const char *part, int n, double device, double cpu)
{
    printf("%s,%d,%s,%.4g,", c->name, n, part, device);
    if (isfinite(cpu)) printf("%.4g", cpu);
    printf(",%.4g,,\n", n / device);
    fflush(stdout);
}

/* The forces at the start, hook by hook; returns whether the device's are the CPU's. */
static int forces(const struct case_of *c, int n, struct sim *device, struct sim *cpu)
{
    static const struct { int hook; const char *part; } parts[] = {{HOOK_H, "search"}, {HOOK_DENSITY, "density"}, {HOOK_FORCE, "force"}};
    struct sim *const sims[] = {device, cpu};
    double built[2] = {NAN, NAN};
    for (int s = 0; s < 2 && sims[s]; s++) {
        sim_find_active(sims[s]);
        built[s] = arrange_seconds(sims[s]);
    }
    print_row(c, "tree", n, built[0], built[1]);
    for (size_t p = c->gas ? 0 : 2; p < sizeof parts / sizeof *parts; p++) {
        double seconds[2] = {NAN, NAN};
        for (int s = 0; s < 2 && sims[s]; s++) seconds[s] = hook_seconds(sims[s], parts[p].hook);
        print_row(c, parts[p].part, n, seconds[0], seconds[1]);
    }
    const char *error = device_error(device->device);
    double rms = cpu && !error ? difference(cpu, device) : NAN;
    bool fine = !error && !device->failure.set && (!cpu || rms < c->bound);
    printf("%s,%d,difference,,,,", c->name, n);
    if (isfinite(rms)) printf("%.2e", rms);
    printf(",%s%s\n", fine ? "ok" : "FAILED: ", fine ? "" : error ? error : device->failure.set ? device->failure.text : "too large");
    fflush(stdout);
    return fine;
}

/* Whole steps, beginning with the forces at the start, which are not counted; row updates a second. */
static void steps(const struct case_of *c, int n, struct sim *sim, const char *part)
{
    run_step(sim, HOOK_RECORD);
    int64_t updates = sim->updates, bytes = sim->device ? device_copied(sim->device) : 0;
    double began = profile_wall();
    for (int k = 0; k < c->steps && !sim->failure.set; k++) run_step(sim, HOOK_LIMIT);
    double took = profile_wall() - began;
    printf("%s,%d,%s,%.4g,,%.4g,,%s\n", c->name, n, part, took, (double)(sim->updates - updates) / took,
           sim->failure.set ? sim->failure.text : "ok");
    if (sim->device)
        printf("%s,%d,%s,%.4g,,,,\n", c->name, n, "bytes copied an update", (double)(device_copied(sim->device) - bytes)
               / (double)(sim->updates - updates));
    fflush(stdout);
}

static int measure(const struct case_of *c, int n, struct device *device)
{
    bool both = n <= CPU_ROWS;
    struct sim *there = case_sim(c, n, device), *here = both ? case_sim(c, n, NULL) : NULL;
    int fine = forces(c, n, there, here);
    case_end(there);
    case_end(here);
    if (c->steps == 0) return fine;
    there = case_sim(c, n, device);
    steps(c, n, there, "steps on the device");
    case_end(there);
    here = both ? case_sim(c, n, NULL) : NULL;
    if (here) steps(c, n, here, "steps on the CPU");
    case_end(here);
    return fine;
}

int gpu_scenes(struct device *device, bool time_it)
{
    static const int rows[] = {1500, 100000, 1000000, 10000000};
    int failed = 0;
    log_silence(true);
    printf("scene,n,part,seconds,cpu_seconds,rows_per_second,rms_difference,verdict\n");
    for (size_t r = time_it; r < (time_it ? sizeof rows / sizeof *rows : 1); r++)
        for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
            if (rows[r] <= cases[c].most) failed += !measure(&cases[c], rows[r], device);
    log_silence(false);
    return failed;
}
