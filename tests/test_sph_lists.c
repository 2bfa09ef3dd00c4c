/* SPDX-License-Identifier: GPL-3.0-or-later
 * What must not change the results of SPH: threads, room for lists, borders of ranks, instruction sets. */
#include "isa.h"
#include "sph_brute.h"
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void cells_know_their_largest_h(void **state)
{
    (void)state;
    struct sim *sim = case_new(2500, case_random, NULL);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    put_to_sleep(sim);
    case_density(sim);
    for (int32_t n = 0; n < sim->tree.n_nodes; n++) {
        const struct node *node = &sim->tree.node[n];
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++)
            assert_true(sim->tree.h_max[n] >= sph_h_now(sim, i));
    }
    case_free(sim);
}

struct result { float h[4000], rho[4000], acc[4000][3], du[4000], signal[4000]; };

static struct result *run_with(int threads, const struct sph_loops *loops, bool forget)
{
    struct sim *sim = case_new(4000, case_evrard, NULL);
    struct result *result = mem_alloc("test", sizeof *result);
    struct species *gas = case_gas(sim);
    omp_set_num_threads(threads);
    if (loops) case_sph(sim)->loops = loops;
    case_arrange(sim);
    case_density(sim);
    for (int32_t b = 0; forget && b < case_sph(sim)->n_batches; b++) case_sph(sim)->batch[b].list = -1;
    case_force(sim);
    memcpy(result->h, gas->h, sizeof result->h);
    memcpy(result->rho, gas->rho, sizeof result->rho);
    memcpy(result->acc, gas->acc, sizeof result->acc);
    memcpy(result->du, gas->du, sizeof result->du);
    memcpy(result->signal, gas->signal, sizeof result->signal);
    case_free(sim);
    return result;
}

static void threads_and_arena_change_nothing(void **state)
{
    (void)state;
    struct result *one = run_with(1, NULL, false), *two = run_with(2, NULL, false), *three = run_with(3, NULL, true);
    assert_memory_equal(one, two, sizeof *one);
    assert_memory_equal(one, three, sizeof *one);
    mem_free(one);
    mem_free(two);
    mem_free(three);
}

/* Lists made before h is known serve the density too: rows that swell more than expected (here those of
 * one side) are missing from them, and their neighbours' batches must notice. */
static void lists_miss_no_row(void **unused)
{
    (void)unused;
    enum { ROWS = 20000 };
    float *rho[2], (*acc[2])[3];
    for (int fresh = 0; fresh < 2; fresh++) {
        struct sim *sim = case_new(ROWS, case_evrard, (const char *const[]){"sph.group_size=64", NULL});
        struct species *gas = case_gas(sim);
        struct sph *sph = case_sph(sim);
        case_arrange(sim);
        case_density(sim);
        for (int64_t i = 0; i < ROWS; i++)
            if (gas->pos[i][0] > 0.3)
                for (int d = 0; d < 3; d++) gas->pos[i][d] *= 1 + 0.5 * (gas->pos[i][0] - 0.3);
        case_arrange(sim);
        sph_module.hook[HOOK_H](sim, sph);
        int stale = 0, listed = 0;
        for (int32_t b = 0; b < sph->n_batches; b++) {
            stale += sph->batch[b].stale;
            listed += sph->batch[b].list >= 0 && !sph->batch[b].stale;
        }
        assert_true(stale > 20 && listed > 20 && !sph->unforeseen);
        sph->unforeseen = fresh;
        sph_module.hook[HOOK_DENSITY](sim, sph);
        case_force(sim);
        rho[fresh] = mem_array("test", float, ROWS);
        acc[fresh] = mem_alloc("test", ROWS * sizeof *acc[fresh]);
        memcpy(rho[fresh], gas->rho, ROWS * sizeof *gas->rho);
        memcpy(acc[fresh], gas->acc, ROWS * sizeof *gas->acc);
        case_free(sim);
    }
    assert_memory_equal(rho[0], rho[1], ROWS * sizeof *rho[0]);
    assert_memory_equal(acc[0], acc[1], ROWS * sizeof *acc[0]);
    for (int fresh = 0; fresh < 2; fresh++) {
        mem_free(rho[fresh]);
        mem_free(acc[fresh]);
    }
}

/* Two ranks whose border runs through groups, their parts computed one after the other on shared rows:
 * the bits of one rank. (A hook is repeated with the ones before it, which find what they found.) */
static void a_border_through_groups_changes_nothing(void **unused)
{
    (void)unused;
    enum { ROWS = 4000, BORDER = 1777 };
    struct result *whole = run_with(1, NULL, false);
    struct sim *sim = case_new(ROWS, case_evrard, NULL);
    struct species *gas = case_gas(sim);
    case_arrange(sim);
    for (int hook = HOOK_H; hook <= HOOK_FORCE; hook++)
        for (int part = 0; part < 2; part++) {
            gas->own = part ? BORDER : 0;
            gas->n_own = part ? ROWS - BORDER : BORDER;
            sim_find_active(sim);
            tree_mark_active(sim);
            for (int h = HOOK_H; h <= (hook < HOOK_DENSITY ? HOOK_H : HOOK_DENSITY); h++)
                sph_module.hook[h](sim, sim->use[0].state);
            if (hook == HOOK_FORCE) case_force(sim);
        }
    assert_memory_equal(gas->h, whole->h, sizeof whole->h);
    assert_memory_equal(gas->rho, whole->rho, sizeof whole->rho);
    assert_memory_equal(gas->acc, whole->acc, sizeof whole->acc);
    assert_memory_equal(gas->du, whole->du, sizeof whole->du);
    assert_memory_equal(gas->signal, whole->signal, sizeof whole->signal);
    mem_free(whole);
    case_free(sim);
}

static void instruction_sets_agree(void **state)
{
    (void)state;
    const struct sph_loops *sets[] = {&sph_loops_v3, &sph_loops_v4};
    const bool runs[] = {isa_runs(ISA_V3), isa_runs(ISA_V4)};
    struct result *one = run_with(1, &sph_loops_v2, false);
    for (int s = 0; s < 2; s++) {
        if (!runs[s]) continue;
        struct result *two = run_with(1, sets[s], false);
        for (int i = 0; i < 4000; i++) {
            float size = fabsf(one->acc[i][0]) + fabsf(one->acc[i][1]) + fabsf(one->acc[i][2]);
            assert_float_equal(one->h[i], two->h[i], 1e-6f * one->h[i]);
            assert_float_equal(one->rho[i], two->rho[i], 3e-6f * one->rho[i]);
            for (int d = 0; d < 3; d++) assert_float_equal(one->acc[i][d], two->acc[i][d], 1e-4f * size);
        }
        mem_free(two);
    }
    mem_free(one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells_know_their_largest_h),
        cmocka_unit_test(threads_and_arena_change_nothing),
        cmocka_unit_test(lists_miss_no_row),
        cmocka_unit_test(a_border_through_groups_changes_nothing),
        cmocka_unit_test(instruction_sets_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
