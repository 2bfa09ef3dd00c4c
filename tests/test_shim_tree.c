/* SPDX-License-Identifier: GPL-3.0-or-later
 * The tree of tree_cuda.cu on the host shim against the CPU's: the same order of rows and the same cells, bit for bit, of sets
 * that break trees; in the midst of block steps; and what happens where the rows do not fit or are not finite. */
#include "device.h"
#include "mem.h"
#include "random.h"
#include "sim.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

/* Where row i of n lies. */
typedef void maker(double pos[3], int64_t i, int64_t n);

static void drawn(double pos[3], int64_t i)
{
    struct random key = {.seed = 1, .id = (uint64_t)i};
    for (int k = 0; k < 3; k++) pos[k] = random_normal(&key, (uint64_t)k);
}

static void normal(double pos[3], int64_t i, int64_t n)
{
    (void)n;
    drawn(pos, i);
}

/* Density r^-7, so that keys agree in their upper halves. */
static void crowded(double pos[3], int64_t i, int64_t n)
{
    (void)n;
    drawn(pos, i);
    const double factor = pow(10, -8 * random_uniform(&(struct random){.seed = 2, .id = (uint64_t)i}, 0));
    for (int k = 0; k < 3; k++) pos[k] *= factor;
}

/* Half at one place, and one far away. */
static void heaped(double pos[3], int64_t i, int64_t n)
{
    drawn(pos, i);
    for (int k = 0; k < 3 && i % 2; k++) pos[k] = 0.25;
    if (i == n - 1) pos[0] = 1e7;
}

/* Pairs at one place, near a heap too narrow for the upper halves. */
static void paired(double pos[3], int64_t i, int64_t n)
{
    (void)n;
    drawn(pos, i / 2);
    for (int k = 0; k < 3 && i % 7 == 0; k++) pos[k] = 0.3 + 1e-9 * pos[k];
}

static void plane(double pos[3], int64_t i, int64_t n)
{
    (void)n;
    drawn(pos, i);
    pos[2] = 0;
}

static void offset(double pos[3], int64_t i, int64_t n)
{
    (void)n;
    drawn(pos, i);
    for (int k = 0; k < 3; k++) pos[k] += 1e6;
}

static void single(double pos[3], int64_t i, int64_t n) { normal(pos, i / n, n); }

/* What a set is apart from its places. */
struct set { maker *place; int64_t rows[N_SPECIES]; int leaf; double blur; bool massless; };

static struct sim *make(const struct set *set, struct device *device)
{
    const enum column columns[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id, COLUMN_acc, COLUMN_rung, COLUMN_rung0};
    struct sim *sim = mem_alloc("test", sizeof *sim);
    int64_t id = 0, all = 0;
    for (int k = 0; k < N_SPECIES; k++) all += set->rows[k];
    for (int k = 0; k < N_SPECIES; k++) {
        struct species *s = &sim->species[k];
        s->kind = (enum species_kind)k;
        for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) species_need(s, columns[c]);
        species_reserve(s, set->rows[k]);
        s->n = s->n_own = set->rows[k];
        for (int64_t i = 0; i < s->n; i++, id++) {
            struct random key = {.seed = 3, .id = (uint64_t)id};
            set->place(s->pos[i], id, all);
            s->id[i] = (uint64_t)(all - id);
            s->mass[i] = set->massless ? 0 : random_uniform(&key, 0);
            s->rung[i] = s->rung0[i] = (uint8_t)(RUNG_TOP - (int)(id % 5));
            for (int d = 0; d < 3; d++) {
                s->vel[i][d] = random_normal(&key, (uint64_t)d + 3);
                s->acc[i][d] = (float)random_normal(&key, (uint64_t)d + 6);
            }
        }
    }
    sim->time = (struct timeline){.dt_max = 0.01, .tick_end = INT64_MAX};
    sim->tree.blur = set->blur;
    sim->device = device;
    tree_need_leaf(&sim->tree, set->leaf);
    return sim;
}

static void release(struct sim *sim)
{
    for (int k = 0; k < N_SPECIES; k++) species_free(&sim->species[k]);
    tree_free(&sim->tree);
    if (sim->device) device_close(sim->device);
    mem_free(sim);
}

static void assert_same(const struct sim *a, const struct sim *b)
{
    assert_int_equal(a->tree.n_nodes, b->tree.n_nodes);
    assert_true(a->tree.side == b->tree.side && memcmp(a->tree.corner, b->tree.corner, sizeof a->tree.corner) == 0);
    for (int k = 0; k < N_SPECIES; k++)
        for (int64_t i = 0; i < a->species[k].n; i++) assert_int_equal(a->species[k].id[i], b->species[k].id[i]);
    const size_t bytes = offsetof(struct node, count) + sizeof a->tree.node->count;
    for (int32_t n = 0; n < a->tree.n_nodes; n++) assert_memory_equal(&a->tree.node[n], &b->tree.node[n], bytes);
}

static const struct set sets[] = {
    {normal, {0, 0, 0, 1000}, 32, 0, false},   {normal, {300, 1, 250, 200}, 16, 0, false}, {normal, {100, 0, 0, 100}, 1, 0, false},
    {crowded, {350, 0, 0, 350}, 16, 0, false}, {crowded, {0, 0, 0, 2000}, 16, 1e-5, false}, {heaped, {250, 0, 0, 250}, 16, 0, false},
    {paired, {350, 0, 0, 350}, 24, 0, false},  {plane, {0, 0, 600, 0}, 48, 0, false},     {offset, {300, 0, 0, 300}, 16, 0, false},
    {single, {20, 0, 0, 300}, 16, 0, false},   {normal, {0, 1, 0, 0}, 16, 0, false},       {normal, {200, 0, 0, 0}, 16, 0, true},
    {normal, {0, 0, 0, 0}, 16, 0, false},
};

/* At the start, and again in the midst of the steps of most rows. */
static void test_same_tree(void **state)
{
    (void)state;
    for (size_t c = 0; c < sizeof sets / sizeof *sets; c++) {
        struct sim *cpu = make(&sets[c], NULL), *device = make(&sets[c], device_open(DEVICE_CUDA));
        const int64_t ticks[] = {0, (int64_t)3 << (RUNG_TOP - 4)};
        for (size_t t = 0; t < sizeof ticks / sizeof *ticks; t++) {
            cpu->time.tick = device->time.tick = ticks[t];
            assert_true(tree_build(cpu) && tree_build(device));
            assert_non_null(device->tree.engine);
            assert_same(cpu, device);
        }
        print_message("set %zu: %d cells\n", c, cpu->tree.n_nodes);
        release(cpu);
        release(device);
    }
}

/* Rows that do not fit: the CPU makes the tree, or the run stops. */
static void test_full(void **state)
{
    (void)state;
    setenv("SHIM_BYTES", "30000", 1);
    struct sim *cpu = make(&sets[0], NULL), *device = make(&sets[0], device_open(DEVICE_AUTO));
    assert_true(tree_build(cpu) && tree_build(device));
    assert_null(sim_device(device));
    assert_same(cpu, device);
    release(device);
    device = make(&sets[0], device_open(DEVICE_CUDA));
    device->device_needed = true;
    assert_false(tree_build(device));
    assert_true(device->failure.set && device->failure.status == STATUS_ENVIRONMENT && strstr(device->failure.text, " needs "));
    unsetenv("SHIM_BYTES");
    release(cpu);
    release(device);
}

static void test_not_finite(void **state)
{
    (void)state;
    struct sim *sim = make(&sets[0], device_open(DEVICE_CUDA));
    sim->species[DARK].pos[7][1] = NAN;
    assert_false(tree_build(sim));
    assert_true(sim->failure.set && sim->failure.status == STATUS_NUMBERS && strstr(sim->failure.text, "position is not finite"));
    release(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_tree), cmocka_unit_test(test_full),
                                       cmocka_unit_test(test_not_finite)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
