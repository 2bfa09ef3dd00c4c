/* SPDX-License-Identifier: GPL-3.0-or-later
 * External potentials: accelerations against differences of the potential, circular orbits that close, energy and
 * angular momentum on eccentric ones, through the whole driver. */
#include "mem.h"
#include "module.h"
#include "run.h"
#include "start.h"
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static const double PI = 3.14159265358979323846;
static const char *const potentials[] = {
    "point_mass: 1", "plummer_mass: 1, plummer_radius: 0.7", "hernquist_mass: 2, hernquist_radius: 0.5",
    "nfw_mass: 3, nfw_radius: 0.4, nfw_within: 2", "logarithmic_velocity: 1, logarithmic_radius: 0.2, logarithmic_flattening: 0.8",
    "disc_mass: 1, disc_length: 0.6, disc_height: 0.1",
    "disc_mass: 1, disc_length: 0.6, disc_height: 0.1, nfw_mass: 3, nfw_radius: 0.4, nfw_within: 2, point_mass: 0.1"};
enum { POTENTIALS = sizeof potentials / sizeof *potentials };

/* One row in the potential, ready to go. */
static struct sim *make(const char *potential, double end, const double pos[3], const double vel[3])
{
    struct problems problems = {0};
    struct scene *scene = scene_new("/");
    const char *const blocks[] = {"units={G: 1}", "start={generator: uniform, n: 1}", "output={snapshot_every: 1e3}"};
    for (int b = 0; b < 3; b++) scene_set(scene, blocks[b], &problems);
    char *block = mem_format("test", "external={%s}", potential), *time = mem_format("test", "time={end: %.17g}", end);
    scene_set(scene, block, &problems);
    scene_set(scene, time, &problems);
    problems_report(&problems);
    mem_free(block);
    mem_free(time);
    struct sim *sim = sim_new(scene, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    for (int k = 0; k < 3; k++) {
        sim->species[DARK].pos[0][k] = pos[k];
        sim->species[DARK].vel[0][k] = vel[k];
    }
    sim_begin(sim);
    return sim;
}

struct adder { struct energy_sink sink; double value; };
static void add(struct energy_sink *sink, const char *column, double value)
{
    assert_string_equal(column, "external");
    ((struct adder *)sink)->value += value;
}

static double potential_at(struct sim *sim, const double pos[3])
{
    struct adder adder = {{add}, 0};
    for (int k = 0; k < 3; k++) sim->species[DARK].pos[0][k] = pos[k];
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->energy) sim->use[u].module->energy(sim, sim->use[u].state, &adder.sink);
    return adder.value;
}

static void test_gradients(void **state)
{
    (void)state;
    static const double places[][3] = {{1, 0, 0}, {0.3, -0.2, 0.1}, {0.01, 0.02, -0.7}, {3, 2, 5}};
    const double zero[3] = {0, 0, 0}, d = 1e-4;
    for (int p = 0; p < POTENTIALS; p++)
        for (int q = 0; q < 4; q++) {
            struct sim *sim = make(potentials[p], 1, places[q], zero);
            assert_true(run_step(sim, HOOK_LIMIT));
            double acc[3], size = 0, pos[3];
            for (int k = 0; k < 3; k++) {
                acc[k] = (double)sim->species[DARK].acc[0][k];
                pos[k] = places[q][k];
                size = fmax(size, fabs(acc[k]));
            }
            for (int k = 0; k < 3; k++) {
                pos[k] = places[q][k] + d;
                double above = potential_at(sim, pos);
                pos[k] = places[q][k] - d;
                assert_float_equal((potential_at(sim, pos) - above) / (2 * d) / size, acc[k] / size, 2e-6);
                pos[k] = places[q][k];
            }
            sim_free(sim);
        }
}

/* The speed on a circle in the plane, from the force there. */
static double circular(const char *potential, double r)
{
    struct sim *sim = make(potential, 1, (const double[3]){r, 0, 0}, (const double[3]){0, 0, 0});
    run_step(sim, HOOK_LIMIT);
    double v = sqrt(-r * (double)sim->species[DARK].acc[0][0]);
    sim_free(sim);
    return v;
}

static void go(struct sim *sim)
{
    while (sim->time.tick < sim->time.tick_end) assert_true(run_step(sim, HOOK_LIMIT));
}

/* A circle closes after 2 pi r/v: leapfrog with steps of z/omega follows an orbit whose mean radius is off by z^2/8, so
 * that the angle is off by 3/2 2 pi z^2/8, 1.1e-3 at z = 0.03, the longest step allowed. */
static void test_circles(void **state)
{
    (void)state;
    for (int p = 0; p < POTENTIALS; p++) {
        const double r = 0.8, v = circular(potentials[p], r), pos[3] = {r, 0, 0}, vel[3] = {0, v, 0};
        struct sim *sim = make(potentials[p], 2 * PI * r / v, pos, vel);
        go(sim);
        for (int k = 0; k < 3; k++) assert_float_equal(sim->species[DARK].pos[0][k], pos[k], 2e-3 * r);
        sim_free(sim);
    }
}

/* A Kepler ellipse comes back to where it was. */
static void test_ellipse(void **state)
{
    (void)state;
    const double pos[3] = {1.5, 0, 0}, vel[3] = {0, sqrt(1 / 3.0), 0};     /* e = 0.5, a = 1 */
    struct sim *sim = make("point_mass: 1, time_step: 0.01", 2 * PI, pos, vel);
    go(sim);
    for (int k = 0; k < 3; k++) assert_float_equal(sim->species[DARK].pos[0][k], pos[k], 1e-3);
    sim_free(sim);
}

/* About ten orbits with half the circular speed, out of the plane. */
static void test_energy(void **state)
{
    (void)state;
    for (int p = 0; p < POTENTIALS; p++) {
        const double v = circular(potentials[p], 1), pos[3] = {1, 0, 0.1}, vel[3] = {0, 0.5 * v, 0.1 * v};
        struct sim *sim = make(potentials[p], 40 / v, pos, vel);
        double start = potential_at(sim, pos) + 0.5 * 0.26 * v * v;
        go(sim);
        const struct species *s = &sim->species[DARK];
        double kinetic = 0, spin = s->pos[0][0] * s->vel[0][1] - s->pos[0][1] * s->vel[0][0];
        for (int k = 0; k < 3; k++) kinetic += 0.5 * s->vel[0][k] * s->vel[0][k];
        double end = kinetic + potential_at(sim, (const double[3]){s->pos[0][0], s->pos[0][1], s->pos[0][2]});
        assert_float_equal((end - start) / (v * v), 0, 3e-3);
        assert_float_equal(spin / (0.5 * v), 1, 1e-4);
        sim_free(sim);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradients), cmocka_unit_test(test_circles), cmocka_unit_test(test_ellipse),
        cmocka_unit_test(test_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
