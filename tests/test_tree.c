/* SPDX-License-Identifier: GPL-3.0-or-later
 * The octree against brute force: every row in one leaf and inside the boxes of all its cells, at the
 * build, after drifting and for rows whose path changed; groups that partition the rows; sets that
 * break trees: one escaper, coincident rows, a line, one row, an empty species. */
#include "mem.h"
#include "random.h"
#include "sim.h"
#include "sort.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

enum { ROWS = 3000 };

static struct sim *new_sim(const int64_t rows[N_SPECIES])
{
    struct sim *sim = mem_alloc("test", sizeof *sim);
    const enum column columns[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id, COLUMN_acc, COLUMN_rung, COLUMN_rung0};
    uint64_t id = 0;
    for (int k = 0; k < N_SPECIES; k++) {
        struct species *s = &sim->species[k];
        s->kind = (enum species_kind)k;
        for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) species_need(s, columns[c]);
        species_reserve(s, rows[k]);
        s->n = s->n_own = rows[k];
        for (int64_t i = 0; i < s->n; i++) {
            struct random key = {1, ++id, 0, random_stream("test_tree")};
            s->id[i] = id;
            s->mass[i] = 1;
            s->rung[i] = s->rung0[i] = RUNG_TOP;
            for (int d = 0; d < 3; d++) {
                s->pos[i][d] = random_normal(&key, (uint64_t)d);
                s->vel[i][d] = random_normal(&key, (uint64_t)d + 3);
                s->acc[i][d] = (float)random_normal(&key, (uint64_t)d + 6);
            }
        }
    }
    sim->time = (struct timeline){.dt_max = 1, .tick_end = INT64_MAX};
    tree_need_leaf(&sim->tree, 16);
    return sim;
}

static void free_sim(struct sim *sim)
{
    for (int k = 0; k < N_SPECIES; k++) species_free(&sim->species[k]);
    tree_free(&sim->tree);
    mem_free(sim);
}

static int64_t all_rows(const struct sim *sim)
{
    int64_t rows = 0;
    for (int k = 0; k < N_SPECIES; k++) rows += sim->species[k].n;
    return rows;
}

/* Every row of every cell lies in the cell's box now. */
static void check_boxes(const struct sim *sim)
{
    for (int32_t n = 0; n < sim->tree.n_nodes; n++) {
        const struct node *node = &sim->tree.node[n];
        for (int k = 0; k < N_SPECIES; k++)
            for (int32_t i = node->first[k]; i < node->first[k] + node->count[k]; i++) {
                double pos[3];
                sim_predict(&sim->time, &sim->species[k], i, pos);
                for (int d = 0; d < 3; d++) {
                    double x = pos[d] - node->pos[d];
                    assert_true(x >= (double)node->low[d] && x <= (double)node->high[d]);
                }
            }
    }
}

/* What a refit leaves of them is not much wider than when it was fitted. */
static void check_slack(const struct sim *sim)
{
    for (int32_t n = 0; n < sim->tree.n_nodes; n++) {
        const struct node *node = &sim->tree.node[n];
        float width = 0;
        for (int d = 0; d < 3; d++) width = fmaxf(width, node->high[d] - node->low[d]);
        assert_true(node->n_children > 0 || node->slack <= 0.125f * width);
    }
}

/* Leaves partition the rows in order, children their parent's, and only leaves of coincident rows
 * hold more than asked. */
static void check_cells(const struct sim *sim, bool coincident)
{
    const struct tree *tree = &sim->tree;
    int64_t in_leaves = 0;
    for (int32_t n = 0; n < tree->n_nodes; n++) {
        const struct node *node = &tree->node[n];
        assert_true(node_rows(node, ALL_SPECIES) > 0);
        if (node->n_children == 0) {
            in_leaves += node_rows(node, ALL_SPECIES);
            assert_true(coincident || node_rows(node, ALL_SPECIES) <= tree->leaf_size);
            continue;
        }
        assert_true(node->n_children > 1 && node->child > n);
        for (int k = 0; k < N_SPECIES; k++) {
            int32_t next = node->first[k];
            for (int32_t c = 0; c < node->n_children; c++) {
                const struct node *child = &tree->node[node->child + c];
                assert_int_equal(child->parent, n);
                assert_int_equal(child->first[k], next);
                next += child->count[k];
            }
            assert_int_equal(next, node->first[k] + node->count[k]);
        }
    }
    assert_int_equal(in_leaves, all_rows(sim));
}

static void check_groups(const struct sim *sim, unsigned mask, int size)
{
    int32_t *group, count = tree_groups(&sim->tree, mask, size, "test", &group);
    int64_t rows = 0, next[N_SPECIES] = {0};
    for (int32_t g = 0; g < count; g++) {
        const struct node *node = &sim->tree.node[group[g]];
        assert_true(node_rows(node, mask) > 0 && (node_rows(node, mask) <= size || node->n_children == 0));
        for (int k = 0; k < N_SPECIES; k++) {
            assert_true(node->first[k] >= next[k]);
            next[k] = (int64_t)node->first[k] + node->count[k];
        }
        rows += node_rows(node, mask);
    }
    int64_t expected = 0;
    for (int k = 0; k < N_SPECIES; k++) expected += mask >> k & 1 ? sim->species[k].n : 0;
    assert_int_equal(rows, expected);
    mem_free(group);
}

static void test_partition(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){ROWS, 0, ROWS / 3, ROWS});
    tree_build(sim);
    check_cells(sim, false);
    check_boxes(sim);
    check_groups(sim, ALL_SPECIES, 64);
    check_groups(sim, GAS_BIT, 32);
    check_groups(sim, STAR_BIT | CLOUD_BIT, 100);
    check_groups(sim, CLOUD_BIT, 100);
    free_sim(sim);
}

static void test_centre(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){ROWS, 0, 0, ROWS});
    double sum[3] = {0};
    for (int k = 0; k < N_SPECIES; k++)
        for (int64_t i = 0; i < sim->species[k].n; i++)
            for (int d = 0; d < 3; d++) sum[d] += sim->species[k].pos[i][d] / (2 * ROWS);
    tree_build(sim);
    assert_float_equal(sim->tree.node[0].mass, 2 * ROWS, 1e-3);
    for (int d = 0; d < 3; d++) assert_true(fabs(sim->tree.node[0].pos[d] - sum[d]) < 1e-12);
    free_sim(sim);
}

/* A build is a function of the keys: shuffled rows give the same order and cells. */
static void test_order_independent(void **unused)
{
    (void)unused;
    struct sim *a = new_sim((int64_t[]){ROWS, 0, 0, 0}), *b = new_sim((int64_t[]){ROWS, 0, 0, 0});
    int32_t *reverse = mem_array("test", int32_t, ROWS);
    for (int32_t i = 0; i < ROWS; i++) reverse[i] = ROWS - 1 - i;
    species_permute(&b->species[GAS], reverse, ROWS);
    tree_build(a);
    tree_build(b);
    assert_int_equal(a->tree.n_nodes, b->tree.n_nodes);
    assert_memory_equal(a->tree.node, b->tree.node, (size_t)a->tree.n_nodes * sizeof(struct node));
    assert_memory_equal(a->species[GAS].id, b->species[GAS].id, ROWS * sizeof(uint64_t));
    mem_free(reverse);
    free_sim(a);
    free_sim(b);
}

/* Boxes hold their rows while time goes on, also when some rows' paths change on the way. */
static void test_refit(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){ROWS, 0, 0, ROWS});
    tree_build(sim);
    struct timeline *time = &sim->time;
    for (int step = 1; step <= 8; step++) {
        time->tick = (int64_t)step << (RUNG_TOP - 4);
        tree_refit(sim);
        check_boxes(sim);
        check_slack(sim);
        for (int k = 0; k < N_SPECIES; k++) {       /* every 50th row gets a kick and starts a step */
            struct species *s = &sim->species[k];
            s->n_ending = 0;
            for (int64_t i = step; i < s->n; i += 50) {
                sim_predict(time, s, i, s->pos[i]);
                for (int d = 0; d < 3; d++) s->vel[i][d] = -2 * s->vel[i][d];
                s->rung[i] = s->rung0[i] = RUNG_TOP - 4;
                s->ending[s->n_ending++] = (int32_t)i;
            }
        }
        tree_follow(sim);
        check_boxes(sim);
        for (int k = 0; k < N_SPECIES; k++)         /* keep the kicked rows on their paths for good */
            for (int64_t e = 0; e < sim->species[k].n_ending; e++) {
                int64_t i = sim->species[k].ending[e];
                for (int d = 0; d < 3; d++) sim->species[k].acc[i][d] = 0;
            }
    }
    free_sim(sim);
}

static void test_escaper(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){0, 0, 0, ROWS});
    sim->species[DARK].pos[7][0] = 1e7;
    tree_build(sim);
    check_cells(sim, false);
    check_boxes(sim);
    free_sim(sim);
}

static void test_coincident_and_line(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){ROWS, 0, 0, ROWS});
    for (int64_t i = 0; i < ROWS / 2; i++)
        for (int d = 0; d < 3; d++) sim->species[GAS].pos[i][d] = 0.3;
    for (int64_t i = 0; i < ROWS; i++)
        for (int d = 1; d < 3; d++) sim->species[DARK].pos[i][d] = 0;
    tree_build(sim);
    check_cells(sim, true);
    check_boxes(sim);
    check_groups(sim, ALL_SPECIES, 64);
    free_sim(sim);
}

static void test_few(void **unused)
{
    (void)unused;
    for (int64_t n = 0; n < 3; n++) {
        struct sim *sim = new_sim((int64_t[]){0, 0, n, 0});
        tree_build(sim);
        assert_int_equal(sim->tree.n_nodes, n > 0);
        check_cells(sim, false);
        check_boxes(sim);
        free_sim(sim);
    }
}

static void test_not_finite(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){0, 0, 0, 100});
    sim->species[DARK].pos[42][1] = NAN;
    tree_build(sim);
    assert_true(sim->failure.set);
    assert_non_null(strstr(sim->failure.text, "particle 43"));
    free_sim(sim);
}

static void test_mark_active(void **unused)
{
    (void)unused;
    struct sim *sim = new_sim((int64_t[]){ROWS, 0, 0, ROWS});
    tree_build(sim);
    sim->time.tick = 8;
    for (int64_t i = 0; i < ROWS; i += 7) sim->species[GAS].rung[i] = 3;
    int64_t active = sim_find_active(sim);
    assert_int_equal(active, (ROWS + 6) / 7);
    tree_mark_active(sim);
    for (int32_t n = 0; n < sim->tree.n_nodes; n++) {
        const struct node *node = &sim->tree.node[n];
        int32_t count = 0;
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++)
            count += sim->species[GAS].rung[i] == 3;
        assert_int_equal(sim->tree.active_count[n], count);
    }
    free_sim(sim);
}

/* Ids use all 64 bits (species_heir sets the highest): ascending, each with its row, few and many, equal ones kept together. */
static void test_sort(void **state)
{
    (void)state;
    enum { MOST = 5000 };
    static const uint64_t masks[] = {UINT64_MAX, (uint64_t)1 << 63 | 7, (uint64_t)7 << 61 | 3, 0xffffffff00000000};
    for (int m = 0; m < 4; m++)
        for (int64_t n = 3; n <= MOST; n = 11 * n + 7) {
            uint64_t *key = mem_array("test", uint64_t, n), *given = mem_array("test", uint64_t, n);
            int32_t *row = mem_array("test", int32_t, n), *seen = mem_array("test", int32_t, n);
            for (int64_t i = 0; i < n; i++) {
                struct random random = {1, (uint64_t)i, 0, random_stream("test_sort")};
                given[i] = key[i] = ((uint64_t)(random_uniform(&random, 0) * 0x1p32) << 32 | (uint64_t)(random_uniform(&random, 1) * 0x1p32))
                                  & masks[m];
                row[i] = (int32_t)i;
            }
            sort_keys(key, row, n);
            for (int64_t i = 0; i < n; i++) {
                if (i > 0) assert_true(key[i - 1] <= key[i]);
                assert_true(key[i] == given[row[i]] && seen[row[i]]++ == 0);
            }
            mem_free(key);
            mem_free(given);
            mem_free(row);
            mem_free(seen);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_partition), cmocka_unit_test(test_centre), cmocka_unit_test(test_order_independent),
        cmocka_unit_test(test_refit), cmocka_unit_test(test_escaper), cmocka_unit_test(test_coincident_and_line),
        cmocka_unit_test(test_few), cmocka_unit_test(test_not_finite), cmocka_unit_test(test_mark_active), cmocka_unit_test(test_sort),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
