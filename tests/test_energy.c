/* SPDX-License-Identifier: GPL-3.0-or-later
 * Sums of energy.csv: compensated in the program as it is built, and the same whoever sums which rows. */
#include "energy.h"
#include "mem.h"
#include "sum.h"
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

enum { ROWS = 1000001 };    /* an odd number: the last block is not full */

/* One row of 1 and a million of 2^-60: a plain sum never leaves 1. */
static void fill(struct species *table)
{
    *table = (struct species){.kind = DARK};
    species_need(table, COLUMN_mass);
    species_need(table, COLUMN_pot);
    species_reserve(table, ROWS);
    table->n = table->n_own = ROWS;
    for (int64_t i = 0; i < ROWS; i++) {
        table->mass[i] = i == 0 ? 1 : 0x1p-50;
        table->pot[i] = i == 0 ? 1 : 0x1p-10f;
    }
}

static void test_compensated(void **state)
{
    (void)state;
    struct species table;
    fill(&table);
    volatile double plain = 0;
    for (int64_t i = 0; i < ROWS; i++) plain = plain + table.mass[i] * (double)table.pot[i];
    assert_true(plain == 1);
    const double exact = 1 + 1e6 * 0x1p-60;     /* to the last digit that a double has */
    for (int threads = 1; threads <= 3; threads++) {
        omp_set_num_threads(threads);
        assert_true(energy_of_rows(&table, table.pot) == exact);
    }
    double parts = 0;       /* two ranks */
    table.n_own = 300007;
    parts += energy_of_rows(&table, table.pot);
    table.own = 300007;
    table.n_own = ROWS - table.own;
    parts += energy_of_rows(&table, table.pot);
    assert_true(parts == exact);
    species_free(&table);
}

/* The small one first, and numbers that cancel. */
static void test_order(void **state)
{
    (void)state;
    const double values[] = {1, 1e100, 1, -1e100};
    struct sum sum = {0, 0};
    for (int i = 0; i < 4; i++) sum_add(&sum, values[i]);
    assert_true(sum_value(&sum) == 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_compensated), cmocka_unit_test(test_order)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
