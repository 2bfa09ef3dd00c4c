/* SPDX-License-Identifier: GPL-3.0-or-later
 * The box: wrapping, images, and SPH in it against SPH in open space among copies of the box on all sides,
 * also where a kernel is wider than the box; a shift of all rows by a part of a side changes nothing. */
#include "sph_case.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

enum { ROWS = 300 };

static void test_wrap(void **state)
{
    (void)state;
    const struct box box = {{2, 0, 0.5}};
    static const double cases[][2][3] = {   /* before, after */
        {{0.5, 7, 0.25}, {0.5, 7, 0.25}}, {{2, -3, 0.5}, {0, -3, 0}}, {{-0.5, 0, -0.125}, {1.5, 0, 0.375}},
        {{5, 1e9, 1.75}, {1, 1e9, 0.25}}, {{-1e-300, 0, -1e-20}, {0, 0, 0}}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        double pos[3] = {cases[c][0][0], cases[c][0][1], cases[c][0][2]};
        box_wrap(&box, pos);
        for (int k = 0; k < 3; k++) assert_float_equal(pos[k], cases[c][1][k], 1e-12);
        assert_true(pos[0] >= 0 && pos[0] < 2 && pos[2] >= 0 && pos[2] < 0.5);
    }
    assert_true(box_shift(&box, 0, 1.2) == -2 && box_shift(&box, 0, 0.9) == 0 && box_shift(&box, 1, 100) == 0);
}

/* Against trying every shift in turn. */
static void test_images(void **state)
{
    (void)state;
    const struct box box = {{1, 0, 0.3}};
    for (uint64_t n = 1; n <= 1000; n++) {
        struct random key = {1, n, 0, 0};
        double own[2][3], other[2][3];
        for (int k = 0; k < 3; k++) {
            uint64_t d = 4 * (uint64_t)k;
            own[0][k] = 3 * random_uniform(&key, d) - 1;
            own[1][k] = own[0][k] + random_uniform(&key, d + 1);
            other[0][k] = 3 * random_uniform(&key, d + 2) - 1;
            other[1][k] = other[0][k] + random_uniform(&key, d + 3);
        }
        struct box_images images = box_images(&box, own, other);
        for (int k = 0; k < 3; k++)
            for (int s = -20; s <= 20; s++) {
                double shift = s * box.side[k];
                bool touches = own[0][k] + shift <= other[1][k] && own[1][k] + shift >= other[0][k];
                bool listed = s >= images.first[k] && s <= images.last[k];
                if (box.side[k] > 0) assert_true(touches == listed);
                else assert_true(listed == (s == 0));
            }
    }
}

/* Row i of the box; velocities of the order of the sound speed. */
static void base_row(int64_t i, const double side[3], double pos[3], double vel[3])
{
    struct random key = {9, (uint64_t)(i % ROWS) + 1, 0, random_stream("test_box")};
    for (uint64_t k = 0; k < 3; k++) {
        pos[k] = side[k] * random_uniform(&key, k);
        vel[k] = random_normal(&key, k + 3);
    }
}

static const double wide_side[3] = {1, 0.4, 0.4}, thin_side[3] = {1, 0.15, 0.15}, open_side[3] = {1, 0.3, 0.4};
enum { ALONG = 3, ACROSS = 7 };

static void wide(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    (void)n;
    (void)key;
    base_row(i, wide_side, pos, vel);
}

static void thin(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    (void)n;
    (void)key;
    base_row(i, thin_side, pos, vel);
}

static void slab(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    (void)n;
    (void)key;
    base_row(i, open_side, pos, vel);
}

/* Copy i / ROWS of row i % ROWS: the first is the row itself. */
static void shift_copy(int64_t i, const double side[3], double pos[3])
{
    int64_t copy = i / ROWS;
    const int64_t place[3] = {copy % ALONG, copy / ALONG % ACROSS, copy / ALONG / ACROSS};
    for (int k = 0; k < 3; k++) {
        int64_t count = k == 0 ? ALONG : ACROSS, s = place[k] <= count / 2 ? place[k] : place[k] - count;
        pos[k] += (double)s * side[k];
    }
}

static void wide_copies(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    wide(pos, vel, i, n, key);
    shift_copy(i, wide_side, pos);
}

static void thin_copies(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    thin(pos, vel, i, n, key);
    shift_copy(i, thin_side, pos);
}

/* x is open: of the copies along it only one is not far away. */
static void slab_copies(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    const double far[3] = {1e3, open_side[1], open_side[2]};
    slab(pos, vel, i, n, key);
    shift_copy(i, far, pos);
}

struct values { double h, rho, acc[3], du, signal, div, curl; };

/* The sums of all rows of the first copy, by id. */
static void compute(case_maker *make, int64_t copies, const double side[3], const double shift[3], struct values *v)
{
    struct sim *sim = case_new(copies * ROWS, make, NULL);
    struct species *gas = case_gas(sim);
    for (int64_t i = 0; i < gas->n; i++) {
        gas->mass[i] = 1.0 / ROWS;
        gas->u[i] = 1 + 0.5f * (float)sin((double)(i % ROWS));
        for (int k = 0; k < 3; k++) {
            sim->box.side[k] = copies == 1 ? side[k] : 0;
            gas->pos[i][k] += shift[k];
        }
    }
    box_wrap_rows(sim);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    for (int64_t i = 0; i < gas->n; i++) {
        if (gas->id[i] > ROWS) continue;
        struct values *at = &v[gas->id[i] - 1];
        *at = (struct values){.h = (double)gas->h[i], .rho = (double)gas->rho[i], .du = (double)gas->du[i],
                              .signal = (double)gas->signal[i], .div = (double)gas->div_v[i], .curl = (double)gas->curl_v[i]};
        for (int k = 0; k < 3; k++) at->acc[k] = (double)gas->acc[i][k];
    }
    case_free(sim);
}

static void assert_alike(const struct values *a, const struct values *b, double tolerance)
{
    double size = 0;
    for (int i = 0; i < ROWS; i++) size += (fabs(b[i].acc[0]) + fabs(b[i].acc[1]) + fabs(b[i].acc[2]) + fabs(b[i].du)) / ROWS;
    for (int i = 0; i < ROWS; i++) {
        assert_float_equal(a[i].h / b[i].h, 1, tolerance);
        assert_float_equal(a[i].rho / b[i].rho, 1, tolerance);
        assert_float_equal(a[i].signal / b[i].signal, 1, tolerance);
        assert_float_equal((a[i].div - b[i].div) * b[i].h, 0, 10 * tolerance);
        assert_float_equal((a[i].curl - b[i].curl) * b[i].h, 0, 10 * tolerance);
        for (int k = 0; k < 3; k++) assert_float_equal((a[i].acc[k] - b[i].acc[k]) / size, 0, 10 * tolerance);
        assert_float_equal((a[i].du - b[i].du) / size, 0, 10 * tolerance);
    }
}

static void test_copies(void **state)
{
    (void)state;
    static const struct { case_maker *box, *copies; double side[3]; } kind[] = {
        {wide, wide_copies, {1, 0.4, 0.4}}, {thin, thin_copies, {1, 0.15, 0.15}}, {slab, slab_copies, {0, 0.3, 0.4}}};
    static const double still[3] = {0}, moved[3] = {0.37, -0.11, 0.29};
    static struct values box[ROWS], copies[ROWS], shifted[ROWS];
    for (size_t k = 0; k < sizeof kind / sizeof *kind; k++) {
        compute(kind[k].box, 1, kind[k].side, still, box);
        compute(kind[k].copies, ALONG * ACROSS * ACROSS, kind[k].side, still, copies);
        compute(kind[k].box, 1, kind[k].side, moved, shifted);
        assert_alike(box, copies, 3e-5);
        assert_alike(shifted, box, 3e-5);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrap), cmocka_unit_test(test_images), cmocka_unit_test(test_copies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
