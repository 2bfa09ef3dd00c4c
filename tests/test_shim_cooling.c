/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cooling on a device, on the host shim, against the CPU's: gas of six decades in temperature and density, with and without
 * heating, of one metallicity and of many; what is booked; all rows active and some. */
#include "device.h"
#include "module.h"
#include "random.h"
#include "start.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { N = 1500 };

static struct sim *gas_sim(const char *const *settings, bool on_device)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    const char *const common[] = {"units={length: kpc, mass: 1e10 Msun, velocity: km/s}", "start={}", "start.generator=uniform",
                                  "start.species=gas", "start.n=1500", "time={end: 1 Gyr, dt_max: 10 Myr}",
                                  "output={snapshot_every: 1 Gyr}", "sph={}"};
    for (size_t s = 0; s < sizeof common / sizeof *common; s++) scene_set(scene, common[s], &problems);
    for (; *settings; settings++) scene_set(scene, *settings, &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_RUN);
    species_need(&sim->species[GAS], COLUMN_metals);    /* read where more than one metallicity is followed */
    problems_report(&sim->problems);
    start_load(sim);
    if (on_device) sim->device = device_open(DEVICE_CUDA);
    sim_begin(sim);
    problems_report(&sim->problems);
    struct species *gas = &sim->species[GAS];
    for (int64_t i = 0; i < N; i++) {
        const struct random key = {3, gas->id[i], 0, random_stream("test_cooling")};
        gas->u[i] = (float)(pow(10, 6 * random_uniform(&key, 0)) * 0.1);
        gas->rho[i] = (float)(pow(10, 6 * random_uniform(&key, 1)) * 1e-6);
        gas->metals[i] = gas->mass[i] * 0.04 * random_uniform(&key, 2);
        gas->rung[i] = gas->rung0[i] = (uint8_t)(RUNG_TOP - 2 * (i % 3 == 0));
    }
    return sim;
}

static void cool(struct sim *sim, int64_t tick)
{
    sim->time.tick = tick;
    sim_find_active(sim);
    if (sim->device) rows_there(sim, GAS, COL(u) | COL(rho), 0);    /* where the rows are, they cool */
    const int64_t before = rows_crossed(sim).columns;
    sim_run_hook(sim, HOOK_SOURCE);
    if (sim->device) assert_true(rows_crossed(sim).columns - before <= 3);      /* mass, rung0, metals: once */
    if (sim->device) assert_false(rows_are_here(&sim->species[GAS], COLUMN_u));
    rows_here(sim, GAS_BIT, COL(u), 0);
}

struct books { struct energy_sink sink; double sum[4]; int n; };

static void note(struct energy_sink *sink, const char *column, double value)
{
    (void)column;
    struct books *books = (struct books *)sink;
    books->sum[books->n++] = value;
}

static struct books booked(struct sim *sim)
{
    struct books books = {{note}, {0}, 0};
    for (int u = 0; u < sim->n_use; u++)
        if (strcmp(sim->use[u].module->name, "cooling") == 0) sim->use[u].module->energy(sim, sim->use[u].state, &books.sink);
    return books;
}

static void compare(const char *const *settings)
{
    struct sim *here = gas_sim(settings, false), *there = gas_sim(settings, true);
    double worst = 0, changed = 0;
    float *start = malloc(N * sizeof *start);
    memcpy(start, here->species[GAS].u, N * sizeof *start);
    for (int64_t quarter = 1; quarter <= 4; quarter += 3) {     /* one row in three, then all */
        cool(here, quarter << (RUNG_TOP - 2));
        cool(there, quarter << (RUNG_TOP - 2));
    }
    for (int64_t i = 0; i < N; i++) {
        const double a = (double)here->species[GAS].u[i], b = (double)there->species[GAS].u[i];
        worst = fmax(worst, fabs(b / a - 1));
        changed += fabs(a / (double)start[i] - 1) > 0.01;
    }
    const struct books a = booked(here), b = booked(there);
    print_message("%s: %.0f of %d rows change, u differs by %.1e at most; booked", settings[0], changed, N, worst);
    for (int k = 0; k < a.n; k++) {
        print_message(" %.4g (%.0e)", b.sum[k], fabs(b.sum[k] - a.sum[k]) / fabs(a.sum[0]));
        assert_true(fabs(b.sum[k] - a.sum[k]) <= 1e-7 * fabs(a.sum[0]));
    }
    print_message("\n");
    assert_true(worst < 1e-6 && changed > N / 4);
    free(start);
    sim_free(here);
    sim_free(there);
}

static void test_same_as_cpu(void **state)
{
    (void)state;
    compare((const char *[]){"cooling={}", NULL});
    compare((const char *[]){"cooling={floor: 10 K, photoelectric: 1}", NULL});
    compare((const char *[]){"cooling={curve: koyama_inutsuka}", NULL});
}

int main(void)
{
    unsetenv("SHIM_DEVICES");
    setenv("TEPHRA_DATA", getenv("TEPHRA_SOURCE") ? getenv("TEPHRA_SOURCE") : ".", 0);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_as_cpu)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
