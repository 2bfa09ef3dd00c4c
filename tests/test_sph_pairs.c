/* SPDX-License-Identifier: GPL-3.0-or-later
 * Kernels of SPH and the formulas of its pairs. */
#include "random.h"
#include "sph/pair.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static void kernels_are_normalised(void **state)
{
    (void)state;
    for (int kind = SPH_CUBIC; kind <= SPH_WENDLAND_C4; kind++) {
        const int steps = 20000;
        double sum = 0, dq = 2.0 / steps;
        for (int k = 0; k < steps; k++) {
            double q = (k + 0.5) * dq;
            sum += 4 * M_PI * q * q * (double)sph_kernel((float)q, kind) * dq;
        }
        assert_float_equal(sum, 1, 1e-6);
        assert_true(sph_kernel(2.0f, kind) == 0 && sph_kernel(3.0f, kind) == 0 && sph_kernel_slope(2.5f, kind) == 0);
    }
    assert_float_equal(sph_kernel(0, SPH_CUBIC), 1 / M_PI, 1e-7);
}

static void slopes_are_derivatives(void **state)
{
    (void)state;
    for (int kind = SPH_CUBIC; kind <= SPH_WENDLAND_C4; kind++)
        for (float q = 0.01f; q < 2.1f; q += 0.01f) {
            double difference = ((double)sph_kernel(q + 0.005f, kind) - (double)sph_kernel(q - 0.005f, kind)) / 0.01;
            assert_float_equal(sph_kernel_slope(q, kind), difference, 1e-4);
            assert_true(sph_kernel_slope(q, kind) <= 0);
        }
}

static int check_pairs(enum sph_kernel kind, bool grad_h, bool signal_velocity)
{
    const struct sph_viscosity visc = {1, 2, 0.01f, 1, 1};
    int met = 0;
    for (uint64_t n = 1; n <= 1000; n++) {
        struct random key = {3, n, 0, 0};
        float r[24];
        for (int k = 0; k < 24; k++) r[k] = (float)random_uniform(&key, (uint64_t)k);
        struct sph_place i = {r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]};
        struct sph_place j = {r[8], r[9], r[10], r[11], r[12], r[13], r[14], r[15]};
        struct sph_state si = {r[16], r[17], r[18], r[19]}, sj = {r[20], r[21], r[22], r[23]};
        struct sph_force a = sph_force_pair(i, si, j, sj, visc, kind, grad_h, signal_velocity);
        struct sph_force b = sph_force_pair(j, sj, i, si, visc, kind, grad_h, signal_velocity);
        float size = fabsf(i.mass * a.ax) + fabsf(i.mass * a.ay) + fabsf(i.mass * a.az), near = 1e-6f * size;
        assert_true(fabsf(i.mass * a.ax + j.mass * b.ax) <= near && fabsf(i.mass * a.ay + j.mass * b.ay) <= near
                    && fabsf(i.mass * a.az + j.mass * b.az) <= near && a.signal == b.signal);
        float work = i.mass * (i.vx * a.ax + i.vy * a.ay + i.vz * a.az + a.du)
                   + j.mass * (j.vx * b.ax + j.vy * b.ay + j.vz * b.az + b.du);
        assert_true(fabsf(work) <= 4 * near);
        float gain = i.mass * sph_conduct_pair(i, si, j, sj, visc, kind, grad_h);
        assert_float_equal(gain, -j.mass * sph_conduct_pair(j, sj, i, si, visc, kind, grad_h), 1e-6f * fabsf(gain));
        assert_true(gain == 0 || (gain > 0) == (sj.half_c > si.half_c));
        met += size > 0;
    }
    return met;
}

static void pairs_are_antisymmetric(void **state)
{
    (void)state;
    for (int kind = SPH_CUBIC; kind < SPH_KERNELS; kind++)
        for (int flags = 0; flags < 4; flags++) assert_true(check_pairs((enum sph_kernel)kind, flags & 1, flags & 2) > 500);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_are_normalised),
        cmocka_unit_test(slopes_are_derivatives),
        cmocka_unit_test(pairs_are_antisymmetric),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
