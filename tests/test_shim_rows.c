/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows on a device (device_rows.h), on the host shim: what crosses and what does not, reorders on both sides, lists, lack of
 * memory. */
#include "device.h"
#include "sph_case.h"
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

int main(void)
{
    unsetenv("SHIM_DEVICES");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crossings), cmocka_unit_test(test_reorder), cmocka_unit_test(test_lists), cmocka_unit_test(test_full),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
