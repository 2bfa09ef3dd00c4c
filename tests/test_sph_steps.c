/* SPDX-License-Identifier: GPL-3.0-or-later
 * Steps of gas: what neighbours allow each other, what a boost must not change. */
#include "log.h"
#include "run.h"
#include "scene_case.h"
#include "sph_brute.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void check_ratio(const char *const *settings, int levels)
{
    struct sim *sim = case_new(2500, case_random, settings);
    struct species *gas = case_gas(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int d = 0; d < 3; d++) gas->vel[i][d] *= 0.02;
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    put_to_sleep(sim);
    uint8_t before[2500];
    memcpy(before, gas->rung, sizeof before);
    int32_t hot = gas->active[gas->n_active / 2];
    gas->u[hot] = 1e8f;
    for (int64_t i = 0; i < gas->n; i++) gas->dt[i] = 1;
    case_density(sim);
    case_force(sim);
    sph_module.hook[HOOK_LIMIT](sim, case_sph(sim));
    int woken = 0;
    memcpy(gas->rung0, gas->rung, sizeof before);
    for (int64_t i = 0; i < gas->n; i++) {
        if (timeline_active(&sim->time, before[i])) gas->rung[i] = (uint8_t)timeline_rung(&sim->time, (double)gas->dt[i]);
        else woken += gas->rung[i] < before[i];
        assert_true(timeline_active(&sim->time, before[i]) || gas->rung[i] <= before[i]);
    }
    assert_true(woken > 10);
    uint8_t after[2500];
    memcpy(after, gas->rung, sizeof after);
    memcpy(gas->rung, before, sizeof before);
    memcpy(gas->rung0, before, sizeof before);
    struct now *now = all_now(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int64_t j = 0; j < gas->n; j++) {
            double reach = 0.999 * (now[i].h + now[j].h);
            bool seen = timeline_active(&sim->time, before[i]) || after[i] < before[i];
            if (seen && distance2(&now[i], &now[j]) < reach * reach) assert_true(after[j] <= after[i] + levels);
        }
    mem_free(now);
    case_free(sim);
}

static void steps_of_neighbours_are_close(void **state)
{
    (void)state;
    check_ratio(NULL, 2);
    check_ratio((const char *const[]){"sph.step_ratio=2", NULL}, 1);
    check_ratio((const char *const[]){"sph.step_ratio=16", NULL}, 4);
}

/* By a thousand times the speed of sound: the same steps and forces. */
static void check_boost(const char *const *settings)
{
    enum { ROWS = 2000 };
    static float dt[2][ROWS], acc[2][ROWS][3], du[2][ROWS];
    for (int boosted = 0; boosted < 2; boosted++) {
        struct sim *sim = case_new(ROWS, case_random, settings);
        struct species *gas = case_gas(sim);
        for (int64_t i = 0; boosted && i < gas->n; i++) gas->vel[i][0] += 1000;
        case_arrange(sim);
        case_density(sim);
        case_force(sim);
        for (int64_t i = 0; i < gas->n; i++) gas->dt[i] = 1;
        sph_module.hook[HOOK_LIMIT](sim, case_sph(sim));
        memcpy(dt[boosted], gas->dt, sizeof dt[boosted]);
        memcpy(acc[boosted], gas->acc, sizeof acc[boosted]);
        memcpy(du[boosted], gas->du, sizeof du[boosted]);
        case_free(sim);
    }
    for (int i = 0; i < ROWS; i++) {
        float size = fabsf(acc[0][i][0]) + fabsf(acc[0][i][1]) + fabsf(acc[0][i][2]);
        assert_float_equal(dt[0][i], dt[1][i], 1e-4f * dt[0][i]);
        for (int d = 0; d < 3; d++) assert_float_equal(acc[0][i][d], acc[1][i][d], 1e-3f * size);
        assert_float_equal(du[0][i], du[1][i], 1e-3f * (size + fabsf(du[0][i])));
    }
}

static void a_boost_changes_nothing(void **state)
{
    (void)state;
    for (int v = 0; v < VARIANTS; v++) check_boost(variants[v]);
}

/* Gas at rest, one of whose rows has shorter steps and at the end of one, while the others sleep, is suddenly ten thousand
 * times hotter. What its neighbours gain is what it loses: were the push of the last moment counted for half of the step that they slept
 * through, they would gain many times as much. */
static void sudden_heat_keeps_the_energy(void **state)
{
    (void)state;
    const char *const scene[] = {"units={}", "units.G=1", "start={}", "start.generator=medium", "start.n=1000", "start.density=1", "start.u=1", "box={}",
        "box.x=1", "box.y=1", "box.z=1", "time={}", "time.end=0.04", "output={}", "output.snapshot_every=0.04",
        "output.energy_every=0.04", "sph={}", NULL};
    struct sim *sim = scene_case_make(scene, (const char *const[]){NULL});
    struct species *gas = &sim->species[GAS];
    const double jump = 1e4, heat = jump * gas->mass[0], before = gas->mass[0] * (double)gas->n;
    int heated = 0;
    log_silence(true);
    assert_true(run_step(sim, HOOK_LIMIT));
    gas->rung[500]--;
    gas->rung0[500]--;
    while (sim->time.tick < sim->time.tick_end) {
        assert_true(run_step(sim, HOOK_EVENT));
        if (heated == 0) {
            assert_true(gas->n_active == 1);
            gas->u[gas->active[0]] += (float)jump;
            gas->signal[gas->active[0]] = (float)(8 * sqrt(5.0 / 3 * 2 / 3 * jump));      /* as a deposit asks for */
            heated++;
        }
        sim_run_hook(sim, HOOK_LIMIT);
    }
    double gain = -before;
    for (int64_t i = 0; i < gas->n; i++)
        gain += gas->mass[i] * ((double)gas->u[i] + 0.5 * (gas->vel[i][0] * gas->vel[i][0] + gas->vel[i][1] * gas->vel[i][1]
                                                            + gas->vel[i][2] * gas->vel[i][2]));
    print_message("sudden heat: %.3g of it came from nowhere\n", gain / heat - 1);
    assert_true(fabs(gain / heat - 1) < 0.05);
    sim_free(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(steps_of_neighbours_are_close),
        cmocka_unit_test(a_boost_changes_nothing),
        cmocka_unit_test(sudden_heat_keeps_the_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
