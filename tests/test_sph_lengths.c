/* SPDX-License-Identifier: GPL-3.0-or-later
 * Smoothing lengths against brute force, on sets that break searches. */
#include "sph_brute.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

static void one_escaper(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    if (i == n / 2) pos[0] = 1e7;
}

static void coincident(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    if (i < n / 2) pos[0] = pos[1] = pos[2] = 0.3;
}

static void all_coincident(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    pos[0] = pos[1] = pos[2] = 0.3;
}

static void line(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    pos[1] = pos[2] = 0;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Half the distance to the n-th neighbour, or to the nearest row elsewhere if that is 0. */
static double brute_h(const struct now *now, int64_t rows, int64_t i, int64_t neighbours, double *scratch)
{
    for (int64_t j = 0; j < rows; j++) scratch[j] = distance2(&now[i], &now[j]);
    qsort(scratch, (size_t)rows, sizeof *scratch, compare_doubles);
    int64_t k = neighbours < rows - 1 ? neighbours : rows - 1;
    double scale = neighbours > k && k > 0 ? cbrt((double)neighbours / (double)k) : 1;
    while (k < rows - 1 && scratch[k] == 0) k++;
    return 0.5 * sqrt(scratch[k]) * scale;
}

static void check_h(int64_t n, case_maker *make, const char *const *settings)
{
    struct sim *sim = case_new(n, make, settings);
    struct species *gas = case_gas(sim);
    case_arrange(sim);
    double *scratch = mem_array("test", double, n);
    for (int pass = 0; pass < 2; pass++) {      /* without and with a first guess */
        sph_module.hook[HOOK_H](sim, case_sph(sim));
        struct now *now = all_now(sim);
        for (int64_t i = 0; i < n; i += 1 + n / 150) {
            double h = fmax(brute_h(now, n, i, case_sph(sim)->neighbours, scratch), case_sph(sim)->h_min);
            if (fabs((double)gas->h[i] - h) > 2e-6 * h)
                fail_msg("row %d: h %.9g, brute force %.9g", (int)i, (double)gas->h[i], h);
        }
        mem_free(now);
    }
    mem_free(scratch);
    case_free(sim);
}

static void h_is_half_the_distance_of_the_last_neighbour(void **state)
{
    (void)state;
    check_h(3000, case_random, NULL);
    check_h(3000, case_evrard, NULL);
    check_h(3000, clustered, NULL);
    check_h(6000, one_escaper, NULL);
    check_h(1000, coincident, NULL);
    check_h(12000, coincident, (const char *const[]){"sph.h_min=0.02", NULL});
    check_h(2000, line, NULL);
    check_h(1728, lattice, NULL);
    check_h(3000, case_random, (const char *const[]){"sph.neighbours=200", NULL});
}

static void too_few_rows_have_an_h(void **state)
{
    (void)state;
    check_h(2, case_random, NULL);
    check_h(30, case_random, NULL);
    check_h(50, case_random, NULL);
    check_h(51, case_random, NULL);
    for (int64_t n = 1; n <= 10000; n *= 100) {
        struct sim *sim = case_new(n, all_coincident, (const char *const[]){"sph.h_min=0.01", NULL});
        case_arrange(sim);
        case_density(sim);
        case_force(sim);
        assert_float_equal(case_gas(sim)->h[0], 0.01, 1e-8);
        assert_float_equal(case_gas(sim)->rho[0], 1 / M_PI * 1e6, 10);
        assert_true(case_gas(sim)->acc[0][0] == 0);
        case_free(sim);
    }
}

static void h_has_a_floor(void **state)
{
    (void)state;
    struct sim *sim = case_new(3000, case_random, (const char *const[]){"sph.h_min=0.4", NULL});
    case_arrange(sim);
    case_density(sim);
    for (int64_t i = 0; i < 3000; i++) assert_true(case_gas(sim)->h[i] >= 0.4f);
    case_free(sim);
}

static void check_smooth_h(const char *const *settings)
{
    struct sim *sim = case_new(3000, case_evrard, settings);
    struct species *gas = case_gas(sim);
    const struct sph *sph = case_sph(sim);
    case_arrange(sim);
    sph_module.hook[HOOK_H](sim, case_sph(sim));
    struct now *now = all_now(sim);
    for (int64_t i = 0; i < gas->n; i++) {
        double h = (double)gas->h[i], rho = -(double)sph->excess * gas->mass[i] / (h * h * h);
        for (int64_t j = 0; j < gas->n; j++)
            rho += gas->mass[j] * (double)sph_kernel((float)(sqrt(distance2(&now[i], &now[j])) / h), sph->kernel) / (h * h * h);
        assert_float_equal(cbrt(3 * (double)sph->neighbours / (32 * M_PI) * gas->mass[i] / rho) / h, 1, 1e-5);
    }
    mem_free(now);
    case_free(sim);
}

static void smooth_h_follows_its_equation(void **state)
{
    (void)state;
    check_smooth_h((const char *const[]){"sph.count=smooth", NULL});
    check_smooth_h(variants[1]);
    check_smooth_h((const char *const[]){GRAD_H, "sph.kernel=wendland_c4", "sph.neighbours=200", NULL});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(h_is_half_the_distance_of_the_last_neighbour),
        cmocka_unit_test(too_few_rows_have_an_h),
        cmocka_unit_test(h_has_a_floor),
        cmocka_unit_test(smooth_h_follows_its_equation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
