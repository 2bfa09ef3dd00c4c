/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the module phases tells of rows whose temperatures, places and masses are given. */
#include "log.h"
#include "module.h"
#include "run.h"
#include "scene_case.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static double told(struct sim *sim, const char *name) { return scene_case_budget(sim, "phases", name); }

static void assert_near(double value, double wanted)
{
    if (!(fabs(value - wanted) <= 1e-9 * fabs(wanted))) fail_msg("%.10g instead of %.10g", value, wanted);
}

/* Every second row hot, within and outside of a cylinder of 0.5 kpc about the z axis, 0.3 kpc to each side of z = 0; volumes of rows
 * m/rho; clouds of 1e5 e^x Msun with x = 1 ... 10 but for one that is lighter than the limit. */
static void test_shares(void **unused)
{
    (void)unused;
    const char *const fixed[] = {"units={length: kpc, mass: 1e10 Msun, velocity: km/s}", "box={x: 1, y: 1, z: 1}",
                                 "start={generator: exchange_box, n: 522, clouds: 11, density: 0.01 cm^-3, temperature: 1e6 K}",
                                 "time={end: 0.02}", "output={snapshot_every: 0.01}", "sph={}", "clouds={}",
                                 "phases={radius: 0.5 kpc, height: 0.3 kpc, hot: 1e5 K, light: 1e5 Msun}", NULL};
    struct sim *sim = scene_case_make(fixed, (const char *const[]){NULL});
    struct species *gas = &sim->species[GAS], *cloud = &sim->species[CLOUD];
    assert_true(run_step(sim, HOOK_LIMIT));
    double mass[2] = {0}, volume[2] = {0}, inside = 0, filled = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        gas->u[i] = i % 2 ? 1e5f : 1e2f;        /* some 5e6 and 5e3 K */
        gas->rho[i] *= i % 2 ? 0.1f : 3;
        const double *x = gas->pos[i];
        if (!(x[0] * x[0] + x[1] * x[1] < 0.25 && fabs(x[2]) < 0.3)) continue;
        mass[i % 2] += gas->mass[i] * 1e10;
        volume[i % 2] += gas->mass[i] / (double)gas->rho[i];
    }
    for (int64_t i = 0; i < cloud->n; i++) {
        const double suns = i == 0 ? 9e4 : 1e5 * exp((double)i);
        cloud->mass[i] = suns / 1e10;
        for (int k = 0; k < 3; k++) cloud->pos[i][k] = 0.05 * (double)i;        /* six of them are within: up to z = 0.25 */
        if (i > 5) continue;
        inside += suns;
        filled += 4 * acos(-1) / 3 * pow(0.05 * sqrt(suns / 1e6), 3);
    }
    assert_true(mass[0] > 0 && mass[1] > 0);
    assert_near(told(sim, "warm_gas ["), mass[0]);
    assert_near(told(sim, "hot_gas ["), mass[1]);
    assert_near(told(sim, "hot_filling ["), volume[1] / (volume[0] + volume[1]));
    assert_near(told(sim, "clouds_inside ["), inside);
    assert_near(told(sim, "cloud_filling ["), filled / (acos(-1) * 0.25 * 0.6));
    assert_near(told(sim, "cloud_slope ["), -1 - 10 / 55.0);
    for (int64_t i = 0; i < gas->n; i++) gas->u[i] = 1e2f;
    assert_near(told(sim, "hot_filling ["), 0);
    sim_free(sim);
}

int main(void)
{
    log_silence(true);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shares)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
