/* SPDX-License-Identifier: GPL-3.0-or-later
 * The grouped walks of walk_cuda.cu and expand_cuda.cu on the host shim against the CPU's kernels with the same groups:
 * the same lists (counted), the same forces to the rounding of floats; bit for bit between shapes of the
 * launch; a part of the rows active; rows at one place; a full device; and against direct sums, by the accuracy asked. */
#include "device.h"
#include "gravity/cell.h"
#include "gravity/walk.h"
#include "gravity_case.h"

/* Where row i of n lies, and its species. */
typedef enum species_kind maker(double pos[3], int64_t i, int64_t n);

/* Crowded as r^3 towards a point off the origin; every third row is gas. */
static enum species_kind crowded(double pos[3], int64_t i, int64_t n)
{
    struct random key = {.seed = 1, .id = (uint64_t)i};
    double unit[3], r = pow(random_uniform(&key, 4), 3);
    (void)n;
    random_direction(&key, 0, unit);
    for (int k = 0; k < 3; k++) pos[k] = 50 + 7 * r * unit[k];
    return i % 3 ? DARK : GAS;
}

/* Half of the rows at one place, the others in a cube around it, one far away. */
static enum species_kind heaped(double pos[3], int64_t i, int64_t n)
{
    struct random key = {.seed = 3, .id = (uint64_t)i};
    for (int k = 0; k < 3; k++) pos[k] = i < n / 2 ? 50 : 46 + 7 * random_uniform(&key, (uint64_t)k);
    if (i == n - 1) pos[0] = 1e6;
    return DARK;
}

/* Forces and potentials of n rows under `settings` ("solver=tree order=2 ..."). */
static struct sim *make(int64_t n, maker *place, const char *settings, struct device *device)
{
    struct sim *sim = gravity_sim(settings);
    for (int k = 0; k < N_SPECIES; k++) species_reserve(&sim->species[k], n);
    for (int64_t i = 0; i < n; i++) {
        double pos[3];
        struct random key = {.seed = 2, .id = (uint64_t)i};
        struct species *s = &sim->species[place(pos, i, n)];
        s->id[s->n] = (uint64_t)i;
        s->mass[s->n] = pow(10, random_uniform(&key, 0)) / (double)n;
        s->rung[s->n] = s->rung0[s->n] = (uint8_t)(RUNG_TOP - (int)(i % 5));
        memcpy(s->pos[s->n], pos, sizeof pos);
        s->n_own = ++s->n;
    }
    sim->device = device;
    sim_begin(sim);
    return sim;
}

/* Forces at a tick: at 0 all rows are active, at 2^(RUNG_TOP - 3) those of the two lowest rungs. */
static void force(struct sim *sim, int64_t tick)
{
    for_species(sim, s) memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    sim->time.dt_max = 1;
    sim->time.tick = tick;
    sim->time.tick_end = INT64_MAX;
    sim->want_potential = true;
    sim_find_active(sim);
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    assert_false(sim->failure.set);
}

/* Root mean square over the active rows of the relative differences of acceleration and potential. */
static void differ(const struct sim *a, const struct sim *b, double rms[2])
{
    int64_t n = 0;
    rms[0] = rms[1] = 0;
    for (int k = 0; k < N_SPECIES; k++)
        for (int64_t r = 0; r < a->species[k].n_active; r++, n++) {
            const int32_t i = a->species[k].active[r];
            const struct species *s = &a->species[k], *t = &b->species[k];
            double d2 = 0, a2 = 0;
            assert_int_equal(s->id[i], t->id[i]);
            for (int c = 0; c < 3; c++) {
                d2 += pow((double)s->acc[i][c] - (double)t->acc[i][c], 2);
                a2 += pow((double)s->acc[i][c], 2);
            }
            rms[0] += d2 / a2;
            rms[1] += pow((double)t->pot[i] / (double)s->pot[i] - 1, 2);
        }
    for (int c = 0; c < 2; c++) rms[c] = sqrt(rms[c] / (double)n);
}

/* What the device does by an error, by the CPU's kernels: every group looks from the root. */
static void reference_group(struct sim *sim, struct gravity *g, int32_t n, int32_t root)
{
    struct walk w = {0};
    float local[CELL_TERMS_MAX] = {0};
    const int order = g->opening.order - GRAVITY_ORDER_MIN;
    walk_open(&w, sim, g, OUTPUT_FORCE);
    const int32_t parent = sim->tree.node[n].parent;
    const struct gravity_view view = walk_view(&w, n, parent >= 0 ? walk_view(&w, parent, 0).unit : 0);
    list_add(&w.waiting, root);
    walk_judge(&w, &view, 0, 1);
    const struct gravity_far into = walk_far(&w, &view, &w.local), far = walk_far(&w, &view, &w.far);
    if (into.n > 0) g->kernels->far->to_local[order](local, &into);
    walk_begin_group(&w, view.centre, view.unit, &sim->tree.node[n]);
    walk_add_local(&w, local);
    if (far.n > 0) g->kernels->far->quadrupoles[1](&w.targets, &far);
    walk_add_leaves(&w, &w.near, n);
    g->cells += into.n + far.n * (int64_t)w.targets.n;
    walk_end_group(&w);
    g->pairs += w.pairs;
    walk_close(&w);
}

/* The forces of the active rows anew, with the other's least accelerations. */
static void reference(struct sim *sim, const float *least)
{
    struct gravity *g = sim_state(sim, "gravity");
    memcpy(g->least, least, (size_t)sim->tree.n_nodes * sizeof *least);
    int32_t *group, n = tree_groups(&sim->tree, ALL_SPECIES, g->opening.group_size, "test", &group);
    g->cells = g->pairs = 0;
    for_species(sim, s) memset(s->acc, 0, (size_t)s->n * sizeof *s->acc);
    for (int32_t i = 0; i < n; i++)
        if (sim->tree.active_count[group[i]] > 0) reference_group(sim, g, group[i], 0);
    mem_free(group);
}

static const struct gravity *gravity_of(const struct sim *sim) { return sim_state(sim, "gravity"); }

/* The CPU and the device on one set, all rows active and then some of them: the same lists, the same forces. */
static void compare(int64_t n, maker *place, const char *settings)
{
    struct sim *cpu = make(n, place, settings, NULL), *device = make(n, place, settings, device_open(DEVICE_CUDA));
    const int64_t ticks[] = {0, (int64_t)1 << (RUNG_TOP - 3)};
    for (int t = 0; t < 2; t++) {
        double rms[2];
        force(cpu, ticks[t]);
        force(device, ticks[t]);
        if (gravity_of(cpu)->opening.solver == SOLVER_FMM) reference(cpu, gravity_of(device)->least);
        assert_non_null(gravity_of(device)->walk_engine);
        differ(cpu, device, rms);
        print_message("%s, tick %d: rms of acceleration %.1e, of potential %.1e, %lld pairs, %lld cells\n", settings, t, rms[0],
                      rms[1], (long long)gravity_of(cpu)->pairs, (long long)gravity_of(cpu)->cells);
        /* Expansions of a group err in floats where the accelerations nearly cancel, the CPU's as much. */
        assert_true(rms[0] < (gravity_of(cpu)->opening.solver == SOLVER_FMM ? 3e-5 : 1e-5) && rms[1] < 1e-5);
        assert_int_equal(gravity_of(cpu)->pairs, gravity_of(device)->pairs);
        assert_int_equal(gravity_of(cpu)->cells, gravity_of(device)->cells);
    }
    sim_free(cpu);
    sim_free(device);
}

#define SAME "precision=float group_size=64 leaf_size=24 accuracy=0.3 "

static void test_same_as_cpu(void **state)
{
    (void)state;
    compare(2000, crowded, SAME "solver=tree order=2 opening_angle=0.6 softening=0.01");
    compare(1200, crowded, SAME "solver=tree order=1 opening_angle=0.5 softening=0.01");
    compare(1200, crowded, SAME "solver=tree order=2 opening_angle=0.6 softening_gas=0.02 softening_dark=0.005");
    compare(1200, crowded, SAME "solver=tree order=2 opening_angle=0.6 softening_gas=0.02 softening_dark=0.01 "
            "softening_kernel=spline");
}

/* Solver fmm: every order, softening of each kind; the lists are the CPU's for groups that look from the root. Accelerations
 * are known, so that errors decide. */
static void test_by_error(void **state)
{
    (void)state;
    compare(2000, crowded, SAME "solver=fmm order=5 tolerance=3e-4 softening=0.01");
    compare(1000, crowded, SAME "solver=fmm order=3 tolerance=1e-3 softening=0.01");
    compare(1000, crowded, SAME "solver=fmm order=4 tolerance=1e-3 softening_gas=0.02 softening_dark=0.005");
    compare(1000, crowded, SAME "solver=fmm order=6 tolerance=1e-5 softening_gas=0.02 softening_dark=0.01 softening_kernel=spline");
    compare(600, heaped, SAME "solver=fmm order=5 tolerance=3e-4");
}

/* A Plummer sphere; one cube full; 20 dense clumps in a cube. */
static enum species_kind plummer(double pos[3], int64_t i, int64_t n)
{
    struct random key = {.seed = 5, .id = (uint64_t)i};
    double unit[3];
    const double r = 1 / sqrt(pow(((double)i + 0.5) / (double)n, -2.0 / 3) - 1);
    random_direction(&key, 0, unit);
    for (int k = 0; k < 3; k++) pos[k] = r * unit[k];
    return DARK;
}

static enum species_kind uniform(double pos[3], int64_t i, int64_t n)
{
    struct random key = {.seed = 6, .id = (uint64_t)i};
    (void)n;
    for (int k = 0; k < 3; k++) pos[k] = random_uniform(&key, (uint64_t)k);
    return DARK;
}

static enum species_kind clumped(double pos[3], int64_t i, int64_t n)
{
    struct random key = {.seed = 7, .id = (uint64_t)i}, clump = {.seed = 8, .id = (uint64_t)(i % 20)};
    (void)n;
    for (int k = 0; k < 3; k++) pos[k] = random_uniform(&clump, (uint64_t)k) + 0.01 * random_normal(&key, (uint64_t)k);
    return DARK;
}

/* The 99th percentile of the errors, as `accuracy` counts them, of a run's first force: with its self-check. */
static void test_accuracy(void **state)
{
    static const struct { const char *name; maker *place; } set[] = {{"plummer", plummer}, {"uniform", uniform}, {"clumped", clumped}};
    static const struct { const char *settings; double asked; } ask[] = {
        {"solver=fmm accuracy=1e-3 softening=0.01", 1e-3}, {"solver=fmm accuracy=1e-4 softening=0.01", 1e-4}};
    (void)state;
    for (int i = 0; i < 6; i++) {
        struct sim *sim = make(2000, set[i / 2].place, ask[i % 2].settings, device_open(DEVICE_CUDA));
        force(sim, 0);
        struct gravity_reference exact = gravity_reference_make(sim, gravity_of(sim), 2000);
        const double held = gravity_reference_held(sim, &exact);
        print_message("%s, accuracy %g: 99 %% err by at most %.2e, opening scaled by %.2f\n", set[i / 2].name, ask[i % 2].asked, held,
                      gravity_of(sim)->scale);
        assert_non_null(gravity_of(sim)->walk_engine);
        assert_true(held <= ask[i % 2].asked && held > 0.01 * ask[i % 2].asked);
        gravity_reference_free(&exact);
        sim_free(sim);
    }
}

/* A heap of more rows than a group or a tile holds, without softening; sets of one group and of one row. */
static void test_edges(void **state)
{
    (void)state;
    compare(900, heaped, SAME "solver=tree order=2 opening_angle=0.6");
    compare(50, crowded, SAME "solver=tree order=2 opening_angle=0.6 softening=0.01");
    struct sim *sim = make(1, crowded, SAME "solver=tree", device_open(DEVICE_CUDA));
    force(sim, 0);
    assert_true(sim->species[GAS].acc[0][0] == 0 && sim->species[GAS].pot[0] == 0);
    sim_free(sim);
}

/* The same bits from every shape of the launch. */
static void test_same_bits(void **state)
{
    (void)state;
    struct sim *sim[3];
    for (int i = 0; i < 3; i++) {
        sim[i] = make(1000, crowded, SAME "solver=tree order=2 softening=0.01", device_open(DEVICE_CUDA));
        struct gravity *g = sim_state(sim[i], "gravity");
        g->walk_engine = walk_engine_create(sim[i]->device, 1 << i);
        force(sim[i], 0);
        for_species(sim[i], s) {
            assert_memory_equal(s->acc, sim[0]->species[s->kind].acc, (size_t)s->n * sizeof *s->acc);
            assert_memory_equal(s->pot, sim[0]->species[s->kind].pot, (size_t)s->n * sizeof *s->pot);
        }
    }
    for (int i = 0; i < 3; i++) sim_free(sim[i]);
}

/* Rows that do not fit: the CPU goes on with the same lists, or the run stops. */
static void test_full(void **state)
{
    (void)state;
    setenv("SHIM_BYTES", "20000", 1);
    struct sim *sim = make(1000, crowded, SAME "solver=tree softening=0.01", device_open(DEVICE_AUTO));
    force(sim, 0);
    assert_null(sim_device(sim));
    sim_free(sim);
    sim = make(1000, crowded, SAME "solver=tree softening=0.01", device_open(DEVICE_CUDA));
    sim->device_needed = true;
    sim_find_active(sim);
    sim_run_hook(sim, HOOK_ARRANGE);
    sim_run_hook(sim, HOOK_FORCE);
    assert_true(sim->failure.set && sim->failure.status == STATUS_ENVIRONMENT && strstr(sim->failure.text, " needs "));
    sim_free(sim);
    unsetenv("SHIM_BYTES");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_as_cpu), cmocka_unit_test(test_by_error),
                                       cmocka_unit_test(test_accuracy), cmocka_unit_test(test_edges),
                                       cmocka_unit_test(test_same_bits), cmocka_unit_test(test_full)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
