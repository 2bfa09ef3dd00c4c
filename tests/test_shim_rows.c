/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows on a device (device_rows.h), on the host shim: what crosses and what does not, reorders on both sides, lists, lack of
 * memory. */
#include "device.h"
#include "sph_case.h"
#include "start.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

enum { N = 700 };

static struct sim *on_device(void)
{
    struct sim *sim = case_new(N, case_random, NULL);
    sim->device = device_open(DEVICE_CUDA);
    sim_find_active(sim);
    return sim;
}

static void device_case_free(struct sim *sim)
{
    struct device *device = sim->device;
    case_free(sim);
    device_close(device);
}

static int64_t columns_crossed(const struct sim *sim) { return rows_crossed(sim).columns; }

/* A column crosses once, until the other side has written it. */
static void test_crossings(void **state)
{
    (void)state;
    struct sim *sim = on_device();
    const struct species *gas = case_gas(sim);
    assert_false(rows_are_there(gas, COL(pos)));
    struct species there = rows_there(sim, GAS, COL(pos) | COL(vel), 0);
    assert_int_equal(columns_crossed(sim), 2);
    assert_int_equal(rows_crossed(sim).bytes, 2 * 24 * N);
    assert_true(rows_are_there(gas, COL(pos) | COL(vel)));
    assert_memory_equal(there.pos, gas->pos, 24 * N);      /* memory of the shim's device is the host's */
    assert_null(there.mass);
    rows_here(sim, GAS_BIT, COL(pos), 0);
    rows_there(sim, GAS, COL(pos), 0);
    assert_int_equal(columns_crossed(sim), 2);
    there = rows_there(sim, GAS, 0, COL(vel));
    assert_int_equal(columns_crossed(sim), 2);
    assert_false(rows_are_here(gas, COLUMN_vel));
    there.vel[5][1] = 17;
    rows_here(sim, ALL_SPECIES, COL(vel), 0);
    assert_int_equal(columns_crossed(sim), 3);
    assert_true(gas->vel[5][1] == 17);
    rows_here(sim, ALL_SPECIES, 0, COL(vel));
    gas->vel[5][1] = 18;
    assert_false(rows_are_there(gas, COL(vel)));
    there = rows_there(sim, GAS, COL(vel), 0);
    assert_int_equal(columns_crossed(sim), 4);
    assert_true(there.vel[5][1] == 18);
    device_case_free(sim);
}

/* A reorder is done on each side with what is up to date there; nothing crosses. */
static void test_reorder(void **state)
{
    (void)state;
    struct sim *sim = on_device();
    struct species *gas = case_gas(sim);
    int32_t order[N];
    for (int32_t i = 0; i < N; i++) {
        order[i] = (i * 37 + 11) % N;
        gas->h[i] = (float)i;
    }
    struct species there = rows_there(sim, GAS, COL(pos) | COL(id) | COL(rung), COL(h) | COL(mass));
    for (int32_t i = 0; i < N; i++) {
        there.h[i] = (float)(2 * i);
        there.mass[i] = i;
        gas->h[i] = NAN;
    }
    const int64_t before = columns_crossed(sim);
    species_permute(gas, order, N);
    there = rows_there(sim, GAS, COL(pos) | COL(id) | COL(rung) | COL(h) | COL(mass), 0);
    assert_int_equal(columns_crossed(sim), before);
    assert_memory_equal(there.pos, gas->pos, 24 * N);
    assert_memory_equal(there.id, gas->id, 8 * N);
    assert_memory_equal(there.rung, gas->rung, N);
    rows_here(sim, GAS_BIT, COL(h) | COL(mass), 0);
    for (int32_t i = 0; i < N; i++) {
        assert_true(gas->id[i] == (uint64_t)order[i] + 1);
        assert_true(gas->h[i] == 2 * (float)order[i] && gas->mass[i] == order[i]);
    }
    device_case_free(sim);
}

/* Lists go over once a step, and not at all where all rows are listed. */
static void test_lists(void **state)
{
    (void)state;
    struct sim *sim = on_device();
    struct species *gas = case_gas(sim);
    assert_null(rows_there(sim, GAS, COL(pos), 0).active);
    for (int64_t i = 0; i < N; i++) gas->rung[i] = gas->rung0[i] = (uint8_t)(RUNG_TOP - 2 * (i % 3 == 0));
    sim->time.tick = (int64_t)1 << (RUNG_TOP - 2);
    assert_int_equal(sim_find_active(sim), (N + 2) / 3);
    const struct species there = rows_there(sim, GAS, COL(pos), 0);
    assert_memory_equal(there.active, gas->active, (size_t)gas->n_active * sizeof *gas->active);
    device_case_free(sim);
}

/* What does not fit leaves every column where it was; the CPU goes on with what was there. */
static void test_full(void **state)
{
    (void)state;
    struct sim *sim = on_device();
    struct species *gas = case_gas(sim);
    rows_there(sim, GAS, 0, COL(h)).h[3] = 5;
    setenv("SHIM_BYTES", "2000", 1);
    rows_there(sim, GAS, 0, COL(h) | COL(pos));
    unsetenv("SHIM_BYTES");
    assert_true(rows_are_here(gas, COLUMN_pos));
    assert_true(sim_leave_device(sim, "test", device_error(sim->device)));
    assert_true(gas->h[3] == 5);
    assert_null(gas->copies);
    device_case_free(sim);
}

/* A whole simulation of gas from its scene, on the device. */
static struct sim *scene_sim(const char *const *settings, const char *integrator)
{
    struct problems problems = {0};
    struct scene *scene = scene_new(".");
    const char *const common[] = {"units={G: 1}", "start={}", "start.generator=uniform", "start.species=gas", "start.n=400",
                                  "time={end: 1, dt_max: 0.0625}", "output={snapshot_every: 1}", "sph={}"};
    for (size_t s = 0; s < sizeof common / sizeof *common; s++) scene_set(scene, common[s], &problems);
    for (; settings && *settings; settings++) scene_set(scene, *settings, &problems);
    scene_set(scene, integrator, &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    problems_report(&sim->problems);
    sim->device = device_open(DEVICE_CUDA);
    sim_begin(sim);
    problems_report(&sim->problems);
    return sim;
}

/* PLAIN: as a run does. COPYING: all columns come home, and go there again, around every call. STALE: what is out of date is
 * filled with NaN before every call, so that whoever reads it unasked spoils the run. */
enum way { PLAIN, COPYING, STALE, WAYS };

static void spoil(struct sim *sim)
{
    for_species(sim, s)
        for (int c = 0; c < N_COLUMNS; c++)
            if (species_has(s, (enum column)c) && !rows_are_here(s, (enum column)c))
                memset(*species_slot(s, (enum column)c), 0xff, (size_t)s->n * species_row_bytes((enum column)c));
}

/* One step of the flat list but for RECORD; crossed: bytes of columns that cross in the calls of each hook. */
static void step(struct sim *sim, enum way way, int64_t crossed[N_HOOKS])
{
    sim_find_active(sim);
    for (int h = 0; h < HOOK_RECORD; h++)
        for (int c = 0; c < sim->n_call; c++) {
            const struct use *use = &sim->use[sim->call[c].use];
            const int64_t before = rows_crossed(sim).bytes;
            if (sim->call[c].hook != h) continue;
            if (way == COPYING || !use->module->resident) rows_here(sim, ALL_SPECIES, COL_ALL, COL_ALL);
            if (way == STALE) spoil(sim);
            use->module->hook[h](sim, use->state);
            crossed[h] += rows_crossed(sim).bytes - before;
            assert_false(sim->failure.set);
        }
    sim->started = true;
}

static void next_tick(struct sim *sim)
{
    uint8_t lowest = RUNG_TOP;
    rows_here(sim, ALL_SPECIES, COL(rung), 0);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) lowest = s->rung[i] < lowest ? s->rung[i] : lowest;
    const int64_t length = (int64_t)1 << lowest;
    sim->time.tick = (sim->time.tick / length + 1) * length;
}

/* Several steps. In all but the first, where gas is alone, nothing of a row crosses between search, density, force, kick and drift but for its two
 * rungs, of a byte each, which LIMIT has chosen on the host. */
static struct sim *march(enum way way, const char *const *settings, const char *integrator, int steps)
{
    struct sim *sim = scene_sim(settings, integrator);
    const bool gravity = sim_state(sim, "gravity");    /* is the host's, and moves what it reads and adds to */
    const int64_t rows = sim->species[GAS].n;
    for (int n = 0; n < steps; n++) {
        int64_t crossed[N_HOOKS] = {0};
        step(sim, way, crossed);
        next_tick(sim);
        if (n == 0 || way != PLAIN) continue;
        if (n == 1) {
            print_message("%s: bytes a row that cross:", integrator);
            for (int h = 0; h < N_HOOKS; h++)
                if (crossed[h] > 0) print_message(" %s %.1f", hook_names[h], (double)crossed[h] / (double)rows);
            print_message("\n");
        }
        if (gravity) continue;
        assert_true(crossed[HOOK_PREDICT] <= rows && crossed[HOOK_H] <= rows);
        assert_int_equal(crossed[HOOK_DENSITY] + crossed[HOOK_FORCE] + crossed[HOOK_CORRECT], 0);
    }
    rows_here(sim, ALL_SPECIES, COL_ALL, 0);
    return sim;
}

static void compare_ways(const char *const *settings, const char *integrator, int steps)
{
    struct sim *sim[WAYS];
    for (enum way way = PLAIN; way < WAYS; way++) sim[way] = march(way, settings, integrator, steps);
    for (enum way way = COPYING; way < WAYS; way++)
        for (int c = 0; c < N_COLUMNS; c++) {
            const struct species *a = case_gas(sim[PLAIN]), *b = case_gas(sim[way]);
            if (species_has(a, (enum column)c) && column_table[c].lifetime == KEEP)
                assert_memory_equal(species_column(a, (enum column)c), species_column(b, (enum column)c),
                                    (size_t)a->n * species_row_bytes((enum column)c));
        }
    assert_true(2 * rows_crossed(sim[PLAIN]).columns < rows_crossed(sim[COPYING]).columns);
    for (enum way way = PLAIN; way < WAYS; way++) sim_free(sim[way]);
}

/* Bit for bit the same whether columns stay or are copied around every call, and nobody reads what he has not asked for. */
static void test_steps(void **state)
{
    (void)state;
    compare_ways((const char *[]){"time.steps=common", NULL}, "time.integrator=leapfrog", 4);
    compare_ways(NULL, "time.integrator=pec", 6);
    compare_ways((const char *[]){"sph.count=smooth", "sph.grad_h=on", "sph.equation=entropy", "sph.strength=shocks", NULL},
                 "time.integrator=leapfrog", 4);
    compare_ways((const char *[]){"gravity={solver: tree, softening: 0.1}", NULL}, "time.integrator=leapfrog", 4);
}

int main(void)
{
    unsetenv("SHIM_DEVICES");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crossings), cmocka_unit_test(test_reorder), cmocka_unit_test(test_lists), cmocka_unit_test(test_full),
        cmocka_unit_test(test_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
