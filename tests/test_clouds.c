/* SPDX-License-Identifier: GPL-3.0-or-later
 * Colliding clouds: counts, mass profile, orbit, rotation and turbulence of their initial state; spectrum and
 * solenoidal part of the random field by transforming it back. */
#include "generator_case.h"
#include "ics/turbulence.h"
#include "random.h"
#include <complex.h>
#include <fftw3.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

extern const struct generator clouds_generator;
static const double none[3] = {0, 0, 0};

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static void test_counts(void **state)
{
    (void)state;
    static const int64_t counts[] = {2, 3, 17, 1000, 4321};
    for (int c = 0; c < 10; c++) {
        const char *keys = c % 2 ? "velocity: 2, impact: 0.5, places: random" : "velocity: 2, impact: 0.5";
        struct sim *sim = generator_case_make(&clouds_generator, keys, counts[c / 2], none);
        const struct species *gas = &sim->species[GAS];
        assert_int_equal(gas->n, counts[c / 2]);
        double mass = 0, pos[3] = {0}, vel[3] = {0};
        for (int64_t i = 0; i < gas->n; i++) {
            assert_int_equal(gas->id[i], i + 1);
            mass += gas->mass[i];
            for (int k = 0; k < 3; k++) {
                pos[k] += gas->mass[i] * gas->pos[i][k];
                vel[k] += gas->mass[i] * gas->vel[i][k];
            }
        }
        assert_float_equal(mass, 2, 1e-12);
        assert_true(norm(pos) < 1e-13 && norm(vel) < 1e-13);
        generator_case_free(sim);
    }
}

/* Each cloud: M(r) = M (r/R)^2 about its own centre, which moves at half the speed on a path b apart. */
static void test_profile(void **state)
{
    (void)state;
    for (int random = 0; random < 2; random++) {
        const char *keys = random ? "mass: 3, radius: 2, velocity: 5, impact: 0.75, separation: 7, places: random"
                                  : "mass: 3, radius: 2, velocity: 5, impact: 0.75, separation: 7";
        struct sim *sim = generator_case_make(&clouds_generator, keys, 20000, none);
        const struct species *gas = &sim->species[GAS];
        for (int cloud = 0; cloud < 2; cloud++) {
            const double side = cloud ? 0.5 : -0.5, centre[3] = {side * 7, side * 1.5, 0};
            int64_t within[10] = {0};
            for (int64_t i = cloud * 10000; i < cloud * 10000 + 10000; i++) {
                double x[3];
                for (int k = 0; k < 3; k++) x[k] = gas->pos[i][k] - centre[k];
                for (int b = (int)(5 * norm(x)); b < 10; b++) within[b]++;
                assert_float_equal(gas->vel[i][0], -side * 5, 1e-12);
                assert_true(gas->vel[i][1] == 0 && gas->vel[i][2] == 0 && norm(x) < 2.05);
            }
            for (int b = 0; b < 10; b++)
                assert_float_equal((double)within[b] / 10000, (b + 1) * (b + 1) / 100.0, random ? 0.02 : 0.006);
        }
        generator_case_free(sim);
    }
}

/* E_rot = beta 2/3 G M^2/R for each cloud; turbulence has the size that was asked for and no net motion. */
static void test_motion(void **state)
{
    (void)state;
    struct sim *sim = generator_case_make(&clouds_generator, "rotation: 0.1", 20000, none);
    double energy = 0;
    for (int64_t i = 0; i < 20000; i++) energy += 0.5 * sim->species[GAS].mass[i] * pow(norm(sim->species[GAS].vel[i]), 2);
    assert_float_equal(energy, 2 * 0.1 * 2.0 / 3, 1e-3);
    generator_case_free(sim);
    sim = generator_case_make(&clouds_generator, "turbulence: 0.3, turbulence_waves: 8", 10000, none);
    double square[2] = {0};
    for (int64_t i = 0; i < 10000; i++) square[i >= 5000] += pow(norm(sim->species[GAS].vel[i]), 2) / 5000;
    assert_float_equal(sqrt(square[0]), 0.3, 1e-9);
    assert_float_equal(sqrt(square[1]), 0.3, 1e-9);
    assert_true(fabs(sim->species[GAS].vel[0][0] - sim->species[GAS].vel[5000][0]) > 1e-3);  /* fields of their own */
    generator_case_free(sim);
}

enum { WAVES = 8, M = 4 * WAVES, POINTS = M * M * M };

/* Energy a mode by shell of wave numbers, and the part of all without divergence, of the field at the points of its own mesh. */
static double transform(double (*vel)[3], double shell[WAVES + 1])
{
    fftw_complex *mode[3];
    for (int d = 0; d < 3; d++) {
        mode[d] = fftw_alloc_complex(POINTS);
        for (int i = 0; i < POINTS; i++) mode[d][i] = vel[i][d];
        fftw_plan plan = fftw_plan_dft_3d(M, M, M, mode[d], mode[d], FFTW_FORWARD, FFTW_ESTIMATE);
        fftw_execute(plan);
        fftw_destroy_plan(plan);
    }
    double all = 0, along = 0, beyond = 0;
    int modes[WAVES + 1] = {0};
    for (int i = 0; i < POINTS; i++) {
        int w[3] = {i / (M * M), i / M % M, i % M};
        double k2 = 0, e = 0;
        double complex dot = 0;
        for (int d = 0; d < 3; d++) {
            w[d] -= w[d] > M / 2 ? M : 0;
            k2 += w[d] * w[d];
            e += pow(cabs(mode[d][i]), 2);
            dot += w[d] * mode[d][i];
        }
        all += e;
        if (k2 > 0) along += pow(cabs(dot), 2) / k2;
        if (k2 > WAVES * WAVES) beyond += e;
        else shell[(int)(sqrt(k2) + 0.5)] += e;
        if (k2 <= WAVES * WAVES) modes[(int)(sqrt(k2) + 0.5)]++;
    }
    for (int k = 0; k <= WAVES; k++) shell[k] /= modes[k];
    for (int d = 0; d < 3; d++) fftw_free(mode[d]);
    assert_true(beyond < 1e-20 * all);
    return 1 - along / all;
}

static void test_spectrum(void **state)
{
    (void)state;
    double (*pos)[3] = mem_alloc("test", POINTS * sizeof *pos), (*vel)[3] = mem_alloc("test", POINTS * sizeof *vel);
    for (int i = 0; i < POINTS; i++) {
        pos[i][0] = (double)(i / (M * M)) / M - 0.5;
        pos[i][1] = (double)(i / M % M) / M - 0.5;
        pos[i][2] = (double)(i % M) / M - 0.5;
    }
    for (int c = 0; c < 3; c++) {
        const double part = c == 0 ? 1 : c == 1 ? 0 : 0.5, slope = c == 0 ? 2 : 1;
        double shell[WAVES + 1] = {0}, square = 0, mean[3] = {0};
        turbulence_fill(&(struct turbulence){slope, part, WAVES, 5, random_stream("test")}, 1, POINTS, pos, vel);
        for (int i = 0; i < POINTS; i++)
            for (int d = 0; d < 3; d++) {
                square += vel[i][d] * vel[i][d] / POINTS;
                mean[d] += vel[i][d] / POINTS;
            }
        assert_float_equal(square, 1, 1e-9);
        assert_true(norm(mean) < 1e-12);
        double solenoidal = transform(vel, shell);
        assert_float_equal(solenoidal, part, c == 2 ? 0.1 : 1e-12);     /* a hundred strong modes or so */
        assert_float_equal(log(shell[6] / shell[3]) / log(2), -slope - 2, 0.3);
    }
    mem_free(pos);
    mem_free(vel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts), cmocka_unit_test(test_profile), cmocka_unit_test(test_motion),
        cmocka_unit_test(test_spectrum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
