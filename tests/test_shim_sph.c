/* SPDX-License-Identifier: GPL-3.0-or-later
 * The kernels of SPH on the host shim against the CPU's loops: smoothing lengths, densities and forces of
 * every variant, all rows active and some of them; bit for bit between shapes of the launch; crowded, lonely and
 * coincident rows; a full device. */
#include "device.h"
#include "sph_case.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

/* Rows of which many lie at one place, and one far away. */
static void heaped(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    for (int d = 0; d < 3 && i < n / 3; d++) pos[d] = 0.5;
    if (i == n - 1) pos[0] = 1000;
}

/* A tick at which the rows of rung RUNG_TOP - 2 alone are active. */
static const int64_t later = (int64_t)1 << (RUNG_TOP - 2);

/* One row in three takes shorter steps. */
static void mix_rungs(struct sim *sim)
{
    struct species *gas = case_gas(sim);
    for (int64_t i = 0; i < gas->n; i++) gas->rung[i] = gas->rung0[i] = (uint8_t)(RUNG_TOP - 2 * (gas->id[i] % 3 == 0));
}

/* Lengths, densities and forces at the start, and again when some rows are active. */
static void compute(struct sim *sim)
{
    mix_rungs(sim);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    rows_here(sim, GAS_BIT, COL_MOTION, 0);
    tree_follow(sim);
    sim->time.tick = later;
    sim_find_active(sim);
    tree_refit(sim);
    tree_mark_active(sim);
    case_density(sim);
    case_force(sim);
    rows_here(sim, GAS_BIT, COL_ALL, 0);
    assert_false(sim->failure.set);
}

/* Root mean square of x - y over that of x, of n floats; the rows of b are those of a. */
static double differ(const float *x, const float *y, int64_t n)
{
    double sum = 0, square = 0;
    for (int64_t i = 0; i < n; i++) {
        assert_true(isfinite(y[i]));
        sum += pow((double)x[i] - (double)y[i], 2);
        square += pow((double)x[i], 2);
    }
    return square > 0 ? sqrt(sum / square) : sqrt(sum);
}

static struct sim *on_device(int64_t n, case_maker *make, const char *const *settings)
{
    struct sim *sim = case_new(n, make, settings);
    sim->device = device_open(DEVICE_CUDA);
    return sim;
}

static void device_case_free(struct sim *sim)
{
    struct device *device = sim->device;
    case_free(sim);
    device_close(device);
}

static void compare(int64_t n, case_maker *make, const char *const *settings)
{
    struct sim *cpu = case_new(n, make, settings), *device = on_device(n, make, settings);
    compute(cpu);
    compute(device);
    assert_non_null(case_sph(device)->engine);
    const struct species *a = case_gas(cpu), *b = case_gas(device);
    const struct { const char *name; const float *x, *y; int64_t width; double bound; } column[] = {
        {"h", a->h, b->h, 1, 1e-6}, {"rho", a->rho, b->rho, 1, 1e-5}, {"div_v", a->div_v, b->div_v, 1, 1e-5},
        {"curl_v", a->curl_v, b->curl_v, 1, 1e-5}, {"omega", a->omega, b->omega, 1, 1e-5}, {"acc", a->acc[0], b->acc[0], 3, 1e-5},
        {"du", a->du, b->du, 1, 2e-5}, {"signal", a->signal, b->signal, 1, make == heaped ? 0.1 : 1e-5}};   /* it ends at 2h, where the last neighbour is */
    print_message("%s %s:", settings && settings[0] ? settings[0] : "classic", settings && settings[0] && settings[1] ? settings[1] : "");
    for (size_t c = 0; c < sizeof column / sizeof *column; c++) {
        if (!column[c].x) continue;
        double rms = differ(column[c].x, column[c].y, n * column[c].width);
        print_message(" %s %.1e", column[c].name, rms);
        assert_true(rms < column[c].bound);
    }
    print_message("\n");
    case_free(cpu);
    device_case_free(device);
}

static void test_same_as_cpu(void **state)
{
    (void)state;
    compare(1500, case_evrard, NULL);
    compare(600, case_random, (const char *[]){"sph.preset=modern", "sph.kernel=wendland_c4", "sph.neighbours=60", NULL});
    compare(600, case_evrard, (const char *[]){"sph.count=smooth", "sph.grad_h=on", NULL});
    compare(600, case_evrard, (const char *[]){"sph.viscosity=signal", "sph.kernel=wendland_c2", "sph.conduction=0.3", NULL});
    compare(600, case_evrard, (const char *[]){"sph.count=smooth", "sph.kernel=wendland_c4", "sph.grad_h=on", "sph.viscosity=signal", NULL});
}

/* More rows in reach than a search keeps; rows at one place; fewer rows than neighbours; one row. */
static void test_edges(void **state)
{
    (void)state;
    compare(600, case_evrard, (const char *[]){"sph.neighbours=150", NULL});
    compare(600, case_evrard, (const char *[]){"sph.neighbours=150", "sph.count=smooth", "sph.kernel=wendland_c4", NULL});
    compare(600, heaped, (const char *[]){"sph.h_min=0.01", NULL});
    compare(30, case_random, NULL);
    compare(1, case_random, NULL);
}

/* The same bits from every shape of the launch. */
static void test_same_bits(void **state)
{
    (void)state;
    struct sim *sim[3];
    for (int k = 0; k < 3; k++) {
        sim[k] = on_device(1000, case_evrard, NULL);
        case_sph(sim[k])->engine = sph_engine_create(sim[k]->device, 1 << k);
        compute(sim[k]);
        const struct species *a = case_gas(sim[0]), *b = case_gas(sim[k]);
        assert_memory_equal(a->h, b->h, (size_t)a->n * sizeof *a->h);
        assert_memory_equal(a->rho, b->rho, (size_t)a->n * sizeof *a->rho);
        assert_memory_equal(a->acc, b->acc, (size_t)a->n * sizeof *a->acc);
        assert_memory_equal(a->du, b->du, (size_t)a->n * sizeof *a->du);
    }
    for (int k = 0; k < 3; k++) device_case_free(sim[k]);
}

/* Rows that do not fit: the CPU goes on, bit for bit what it gives from the start. */
static void test_full(void **state)
{
    (void)state;
    struct sim *cpu = case_new(1000, case_evrard, NULL);
    compute(cpu);
    setenv("SHIM_BYTES", "30000", 1);
    struct sim *device = on_device(1000, case_evrard, NULL);
    compute(device);
    unsetenv("SHIM_BYTES");
    const struct species *a = case_gas(cpu), *b = case_gas(device);
    assert_true(device->device_left);
    assert_memory_equal(a->rho, b->rho, (size_t)a->n * sizeof *a->rho);
    assert_memory_equal(a->acc, b->acc, (size_t)a->n * sizeof *a->acc);
    case_free(cpu);
    device_case_free(device);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_as_cpu), cmocka_unit_test(test_edges),
                                       cmocka_unit_test(test_same_bits), cmocka_unit_test(test_full)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
