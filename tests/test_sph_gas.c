/* SPDX-License-Identifier: GPL-3.0-or-later
 * Equations of state and of energy, and where the viscosity is strong. */
#include "sph_brute.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

/* But what its pressure and viscosity do to its motion is counted: sum m (v a + du) = 0. */
static void isothermal_gas_books_its_energy(void **state)
{
    (void)state;
    const char *const settings[] = {"sph.eos=isothermal", "sph.sound_speed=0.3", NULL};
    struct sim *sim = case_new(2000, case_random, settings);
    struct species *gas = case_gas(sim);
    assert_null(gas->u);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    double size = 0;
    double off = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        const double taken = gas->mass[i] * (double)gas->du[i];
        off += taken;
        size += fabs(taken);
        for (int k = 0; k < 3; k++) off += gas->mass[i] * gas->vel[i][k] * (double)gas->acc[i][k];
    }
    assert_true(size > 0 && isfinite(size) && fabs(off) < 1e-6 * size);
    case_free(sim);
}

/* P/rho^2 and the speed of sound as the pair forces see them: isothermal while thin, gamma = 5/3 when dense, the
 * speed of sound the derivative of the pressure between. */
static void barotropic_gas_stiffens(void **state)
{
    (void)state;
    const char *const settings[] = {"sph.eos=barotropic", "sph.sound_speed=0.3", "sph.stiff_density=10", NULL};
    struct sim *sim = case_new(SPH_LANES, case_random, settings);
    struct species *gas = case_gas(sim);
    case_arrange(sim);
    int32_t row[SPH_LANES];
    for (int i = 0; i < SPH_LANES; i++) row[i] = i;
    for (float rho = 1e-3f; rho < 1e8f; rho *= 10) {
        struct sph_lanes lanes;
        for (int i = 0; i < 3; i++) gas->rho[i] = rho * (1 + 0.01f * (float)(i - 1));
        sph_lanes_state(&lanes, sim, case_sph(sim), (struct sph_region){row, 3});
        double p[3], c2 = 4 * (double)lanes.half_c[1] * (double)lanes.half_c[1];
        for (int i = 0; i < 3; i++) p[i] = (double)lanes.p[i] * (double)gas->rho[i] * (double)gas->rho[i];
        assert_float_equal((p[2] - p[0]) / (0.02 * (double)rho) / c2, 1, 1e-3);
        assert_float_equal(p[1] / (0.09 * (double)rho), 1 + cbrt(pow((double)rho / 10, 2)), 1e-5 * p[1] / (0.09 * (double)rho));
    }
    case_free(sim);
}

/* Squeezed without viscosity: u follows the density, to the power gamma - 1. */
static void entropy_is_kept(void **state)
{
    (void)state;
    struct sim *sim = case_new(3000, case_evrard, variants[1]);
    struct species *gas = case_gas(sim);
    double before[3000];
    for (int squeezed = 0; squeezed < 2; squeezed++) {
        for (int64_t i = 0; squeezed && i < gas->n; i++)
            for (int d = 0; d < 3; d++) gas->pos[i][d] *= 0.8 + 0.1 * d;
        sim->time.tick = squeezed ? (int64_t)1 << RUNG_TOP : 0;
        case_arrange(sim);
        if (!squeezed)
            for (int64_t i = 0; i < gas->n; i++) gas->id[i] = (uint64_t)i;
        case_density(sim);
        for (int64_t i = 0; i < gas->n; i++) {
            double entropy = (double)gas->u[i] * pow((double)gas->rho[i], -2.0 / 3);
            if (squeezed) assert_float_equal(entropy / before[gas->id[i]], 1, 1e-5);
            before[gas->id[i]] = entropy;
        }
    }
    case_free(sim);
}

/* The viscosity is at its least where gas has flowed evenly for long, at full strength where it begins
 * to converge, and goes back with time. */
static void strength_follows_shocks(void **state)
{
    (void)state;
    struct sim *sim = case_new(8000, lattice, (const char *const[]){"sph.strength=shocks", "sph.alpha_min=0.1", NULL});
    struct species *gas = case_gas(sim);
    double mean[4] = {0};
    for (int step = 0; step < 4; step++) {
        sim->time.tick = (int64_t)step << RUNG_TOP;
        for (int64_t i = 0; i < gas->n; i++) {
            gas->u[i] = 1;
            for (int d = 0; d < 3; d++) gas->vel[i][d] = step == 2 ? -300 * (gas->pos[i][d] - 0.5) : 0;
        }
        case_arrange(sim);
        case_density(sim);
        for (int64_t i = 0; i < gas->n; i++) {
            bool inner = fabs(gas->pos[i][0] - 0.5) < 0.2 && fabs(gas->pos[i][1] - 0.5) < 0.2 && fabs(gas->pos[i][2] - 0.5) < 0.2;
            if (inner) mean[step] = fmax(mean[step], (double)gas->strength[i]);
        }
    }
    assert_float_equal(mean[0], 1, 1e-6);       /* the start */
    assert_true(mean[1] < 0.3 && mean[2] > 0.5 && mean[3] < 0.3);
    case_free(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(isothermal_gas_books_its_energy),
        cmocka_unit_test(barotropic_gas_stiffens),
        cmocka_unit_test(entropy_is_kept),
        cmocka_unit_test(strength_follows_shocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
