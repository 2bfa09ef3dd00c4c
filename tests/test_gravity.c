/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gravity against brute force in double: pair formulas, kernels of every instruction set, expansions
 * exact to their order, solvers whose errors fall as their openings close, momentum, threads. */
#include "gravity/cell.h"
#include "gravity/contact.h"
#include "gravity_case.h"
#include <omp.h>

/* --- formulas --- */

/* The pull is the gradient of the depth; both are what the papers say. */
static void test_pairs(void **state)
{
    (void)state;
    const double h = 2.8, step = 1e-5;
    for (int form = SOFT_PLUMMER; form <= SOFT_SPLINE; form++)
        for (double r = 0.05; r < 4; r += 0.01) {
            struct pair p = pair_any((enum softening_form)form, r * r, 3, h * h);
            double up = pair_any((enum softening_form)form, (r + step) * (r + step), 3, h * h).depth;
            double down = pair_any((enum softening_form)form, (r - step) * (r - step), 3, h * h).depth;
            assert_true(fabs(p.pull * r + (up - down) / (2 * step)) < 1e-8);
        }
    struct pair plummer = pair_any(SOFT_PLUMMER, 9, 5, 16);
    assert_true(fabs(plummer.pull - 5.0 / 125) < 1e-15 && fabs(plummer.depth - 1) < 1e-15);
    assert_true(fabs(pair_any(SOFT_SPLINE, 0, 1, h * h).depth - 1) < 1e-14);    /* 2.8/h: Springel (2005) */
    assert_true(fabs(pair_any(SOFT_SPLINE, 9, 1, h * h).depth - 1.0 / 3) < 1e-15);
    assert_true(pair_any(SOFT_PLUMMER, 0, 1, 0).depth == 0);
    assert_true(pair_any(SOFT_SPLINE, 0, 1, 0).depth == 0);
}

enum { TARGETS = 37, SOURCES = 150 };

/* Every kernel of every instruction set that this processor has, against the formulas in double. */
static void check_kernel(gravity_pair_sum *sum, int form, bool potential, bool own, double limit)
{
    float x[4][48], soft[SOURCES];
    int32_t self[48];
    double out[4][48] = {{0}}, scale[2] = {0};
    struct gravity_source row[SOURCES];
    for (int j = 0; j < SOURCES; j++) {
        struct random key = {3, (uint64_t)j, 0, 0};
        row[j] = (struct gravity_source){(float)random_normal(&key, 0), (float)random_normal(&key, 1),
                                         (float)random_normal(&key, 2), (float)random_uniform(&key, 9)};
        soft[j] = form == SOFT_COMMON ? 0.01f : 0.1f * (float)random_uniform(&key, 12);
    }
    for (int i = 0; i < 48; i++) {
        x[0][i] = row[i].x, x[1][i] = row[i].y, x[2][i] = row[i].z, x[3][i] = soft[i];
        self[i] = i;
    }
    struct gravity_targets t = {.n = TARGETS, .capacity = 48, .x = x[0], .y = x[1], .z = x[2], .unit = 1, .soft = x[3],
                                .own = self,
                                .ax = out[0], .ay = out[1], .az = out[2], .depth = out[3]};
    sum(&t, &(struct gravity_sources){.n = SOURCES, .capacity = SOURCES, .row = row, .soft = soft, .soft2 = 0.02f});
    for (int i = 0; i < TARGETS; i++) {
        double e[4] = {0};
        for (int j = 0; j < SOURCES; j++) {
            double d[3] = {(double)row[j].x - (double)x[0][i], (double)row[j].y - (double)x[1][i], (double)row[j].z - (double)x[2][i]};
            struct pair p = pair_any((enum softening_form)form, d[0] * d[0] + d[1] * d[1] + d[2] * d[2],
                                     (double)row[j].mass, (double)soft[j] + (double)x[3][i]);
            for (int k = 0; k < 3; k++) e[k] += p.pull * d[k];
            if (!own || i != j) e[3] += p.depth;
        }
        scale[0] = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
        scale[1] = e[3];
        for (int k = 0; k < 3; k++) assert_true(fabs(out[k][i] - e[k]) < 3 * limit * (scale[0] + scale[1]));
        if (potential) assert_true(fabs(out[3][i] - e[3]) < limit * scale[1]);
    }
}

static void test_kernels(void **state)
{
    (void)state;
    for (int v = 0; v < N_ISA; v++) {
        if (!isa_runs((enum isa)v)) continue;
        const struct gravity_kernels *kernels = gravity_kernels_find((enum isa)v);
        const struct gravity_pair_table *pair = kernels->pair;
        for (int r = 0; r < GRAVITY_REFINEMENTS; r++)
            for (int form = 0; form < GRAVITY_FORMS; form++) {
                double limit = r == GRAVITY_ROUGH ? (double)pair->guess_error : 1e-6;
                check_kernel(pair->acc[r][form], form, false, false, limit);
                check_kernel(pair->pot[r][form], form, true, false, limit);
                check_kernel(pair->own[r][form], form, true, true, limit);
            }
    }
}

/* --- expansions, in double --- */

/* Moments of a set about its mean and their part in the local expansion at `centre`; order: a literal. */
HD void expand(double *local, struct rows rows, const double centre[3], double eps2, int order)
{
    double moment[CELL_TERMS_MAX] = {0}, d[CELL_TERMS_MAX] = {0};
    for (int64_t i = 0; i < rows.n; i++) {
        struct cell_powers p[3];
        for (int k = 0; k < 3; k++) p[k] = cell_power(-rows.pos[i][k]);
        cell_add_row(moment, rows.mass[i], &p[0], &p[1], &p[2], order);
    }
    cell_derivatives(d, (struct cell_vector){centre[0], centre[1], centre[2]}, eps2, order);
    cell_to_local(local, 1, moment, d, order);
}

/* Depth and acceleration at x from a local expansion. */
static void evaluate(double field[4], const double *local, const double x[3], int order)
{
    static const double factorial[] = {1, 1, 2, 6, 24, 120, 720};
    for (int n = 0; n <= order; n++)
        for (int a = n; a >= 0; a--)
            for (int b = n - a; b >= 0; b--) {
                int c = n - a - b, power[3] = {a, b, c};
                double l = local[CELL_INDEX(a, b, c)] / (factorial[a] * factorial[b] * factorial[c]);
                double p = pow(x[0], a) * pow(x[1], b) * pow(x[2], c);
                field[3] += l * p;
                for (int k = 0; k < 3; k++)
                    if (power[k] > 0) field[k] += l * power[k] * p / x[k];
            }
}

/* Error of depth and force at a target when source and target have the given size, at distance 3. */
static void expansion_error(int order, double size, double error[2])
{
    struct rows rows = rows_make(20);
    const double eps2 = 0.3, centre[3] = {2, -1, 2}, at[3] = {0.4 * size, 0.3 * size, -0.5 * size};
    double local[CELL_TERMS_MAX] = {0}, mean[3] = {0}, e[4] = {0};
    for (int64_t i = 0; i < rows.n; i++)
        for (int k = 0; k < 3; k++) mean[k] += rows.pos[i][k] / (double)rows.n;
    for (int64_t i = 0; i < rows.n; i++)
        for (int k = 0; k < 3; k++) rows.pos[i][k] = size * (rows.pos[i][k] - mean[k]);
    switch (order) {
    case 3: expand(local, rows, centre, eps2, 3); break;
    case 4: expand(local, rows, centre, eps2, 4); break;
    case 5: expand(local, rows, centre, eps2, 5); break;
    default: expand(local, rows, centre, eps2, 6); break;
    }
    evaluate(e, local, at, order);
    for (int64_t i = 0; i < rows.n; i++) {
        double r[3], r2 = eps2;
        for (int k = 0; k < 3; k++) {
            r[k] = rows.pos[i][k] - centre[k] - at[k];
            r2 += r[k] * r[k];
        }
        for (int k = 0; k < 3; k++) e[k] -= rows.mass[i] * r[k] / (r2 * sqrt(r2));
        e[3] -= rows.mass[i] / sqrt(r2);
    }
    error[0] = fabs(e[3]);
    error[1] = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    rows_free(rows);
}

static void test_orders(void **state)
{
    (void)state;
    for (int order = GRAVITY_ORDER_MIN; order <= GRAVITY_ORDER_MAX; order++) {
        double near[2], far[2];
        expansion_error(order, 0.04, near);
        expansion_error(order, 0.02, far);
        /* The moment of order P, which only the potential feels, is not kept. */
        for (int i = 0; i < 2; i++) assert_true(near[i] / far[i] > ldexp(0.7, order));
    }
}

/* Moments about one centre, moved to another, are those about the other. */
static void test_shifts(void **state)
{
    (void)state;
    const int order = 6;
    struct rows rows = rows_make(10);
    double here[CELL_TERMS_MAX] = {0}, there[CELL_TERMS_MAX] = {0};
    const double shift[3] = {0.3, -0.2, 0.5};
    for (int64_t i = 0; i < rows.n; i++) {
        struct cell_powers p[3], q[3];
        for (int k = 0; k < 3; k++) {
            p[k] = cell_power(-rows.pos[i][k]);
            q[k] = cell_power(-(rows.pos[i][k] + shift[k]));
            here[1 + k] -= rows.mass[i] * rows.pos[i][k];
            there[1 + k] -= rows.mass[i] * (rows.pos[i][k] + shift[k]);
        }
        here[0] += rows.mass[i];
        there[0] += rows.mass[i];
        cell_add_row(here + CELL_TERMS(2), rows.mass[i], &p[0], &p[1], &p[2], order);
        cell_add_row(there + CELL_TERMS(2), rows.mass[i], &q[0], &q[1], &q[2], order);
    }
    cell_shift_moments(here, (struct cell_vector){-shift[0], -shift[1], -shift[2]}, order);
    for (int i = 0; i < CELL_TERMS(order); i++) assert_true(fabs(here[i] - there[i]) < 1e-13);
    rows_free(rows);
}

/* --- solvers --- */

static void test_errors_fall(void **state)
{
    (void)state;
    struct rows rows = rows_make(3000);
    const double eps = 0.02;
    double wide = check_rows(rows, "solver=tree order=1 opening_angle=1", eps, 1, 0.1).rms;
    double narrow = check_rows(rows, "solver=tree order=1 opening_angle=0.5", eps, 0.1, 0.01).rms;
    double quadrupole = check_rows(rows, "solver=tree order=2 opening_angle=0.5", eps, 0.05, 0.01).rms;
    double grouped = check_rows(rows, "solver=tree order=2 opening_angle=0.5 group_size=32", eps, 0.05, 0.01).rms;
    assert_true(narrow < 0.6 * wide && quadrupole < 0.5 * narrow);
    double large = check_rows(rows, "solver=tree order=2 opening_angle=0.5 group_size=1000", eps, 0.05, 0.01).rms;
    assert_true(large < grouped);
    double loose = check_rows(rows, "solver=fmm order=4 tolerance=1e-2", eps, 0.5, 0.05).rms;
    double tight = check_rows(rows, "solver=fmm order=4 tolerance=1e-4", eps, 0.02, 1e-3).rms;
    double high = check_rows(rows, "solver=fmm order=6 tolerance=1e-6", eps, 1e-3, 1e-4).rms;
    assert_true(tight < 0.3 * loose && high < 0.1 * tight);
    check_rows(rows, "solver=direct", eps, 1e-5, 2e-6);
    check_rows(rows, "solver=direct precision=double", eps, 2e-7, 2e-7);
    rows_free(rows);
}

/* What was asked holds for 99 % of the rows, for both softened forces and without any. */
static void test_accuracy(void **state)
{
    (void)state;
    struct rows rows = rows_make(5000);
    const char *const setting[] = {"solver=tree", "solver=fmm", "solver=fmm softening_kernel=spline", "solver=tree softening_kernel=spline"};
    for (int i = 0; i < 4; i++)
        for (double accuracy = 1e-2; accuracy > 5e-5; accuracy /= 10) {
            char *text = mem_format("test", "%s accuracy=%g", setting[i], accuracy);
            double p99 = check_rows(rows, text, i % 2 ? 0.05 : 0, 1, 0.1).p99;
            if (p99 > accuracy) print_message("%s: 99 %% err by %.2e\n", text, p99);
            assert_true(p99 <= accuracy);
            mem_free(text);
        }
    rows_free(rows);
}

/* |sum m a| over sum m |a|. */
static double momentum_rate(const struct sim *sim)
{
    const struct species *s = &sim->species[DARK];
    double rate[3] = {0}, size = 0;
    for (int64_t i = 0; i < s->n; i++) {
        double a2 = 0;
        for (int k = 0; k < 3; k++) {
            rate[k] += s->mass[i] * (double)s->acc[i][k];
            a2 += (double)s->acc[i][k] * (double)s->acc[i][k];
        }
        size += s->mass[i] * sqrt(a2);
    }
    return sqrt(rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2]) / size;
}

/* Neither walk is symmetric bit for bit, and neighbours share their errors: what is left of the momentum is a small part
 * of the accuracy asked (doc/manual/gravity.md has other sets). */
static void test_momentum_of_walks(void **state)
{
    (void)state;
    const struct { const char *solver; double accuracy; } of[] = {
        {"tree", 1e-2}, {"tree", 1e-3}, {"tree", 1e-4}, {"fmm", 1e-2}, {"fmm", 1e-3}, {"fmm", 1e-4}};
    struct rows rows = rows_make(20000);
    for (size_t c = 0; c < sizeof of / sizeof *of; c++) {
        char *text = mem_format("test", "solver=%s accuracy=%g softening=0.01", of[c].solver, of[c].accuracy);
        struct sim *sim = rows_forces(rows, text);
        double rate = momentum_rate(sim);
        print_message("%s: momentum %.1e\n", text, rate);
        assert_true(rate < 0.01 * of[c].accuracy);
        sim_free(sim);
        mem_free(text);
    }
    rows_free(rows);
}

static void test_momentum(void **state)
{
    (void)state;
    struct rows rows = rows_make(2000);
    struct sim *sim = rows_forces(rows, "solver=direct softening=0.01");
    const struct species *s = &sim->species[DARK];
    int32_t *list = mem_array("test", int32_t, s->n);
    double (*exact)[4] = mem_alloc("test", (size_t)s->n * sizeof *exact), rate[2][3] = {{0}}, size = 0;
    for (int32_t i = 0; i < s->n; i++) list[i] = i;
    gravity_direct_rows(sim, sim_state(sim, "gravity"), s, list, s->n, exact);
    for (int64_t i = 0; i < s->n; i++) {
        size += s->mass[i] * sqrt(exact[i][0] * exact[i][0] + exact[i][1] * exact[i][1] + exact[i][2] * exact[i][2]);
        for (int k = 0; k < 3; k++) {
            rate[0][k] += s->mass[i] * (double)s->acc[i][k];
            rate[1][k] += s->mass[i] * exact[i][k];
        }
    }
    for (int k = 0; k < 3; k++) assert_true(fabs(rate[0][k]) < 1e-6 * size && fabs(rate[1][k]) < 1e-14 * size);
    mem_free(exact);
    mem_free(list);
    sim_free(sim);
    rows_free(rows);
}

static void test_threads(void **state)
{
    (void)state;
    struct rows rows = rows_make(4000);
    for (int i = 0; i < 3; i++) {
        char *text = mem_format("test", "softening=0.01 %s", solvers[i]);
        omp_set_num_threads(1);
        struct sim *one = rows_forces(rows, text);
        omp_set_num_threads(2);
        struct sim *two = rows_forces(rows, text);
        assert_memory_equal(one->species[DARK].acc, two->species[DARK].acc, (size_t)rows.n * sizeof(float[3]));
        assert_memory_equal(one->species[DARK].pot, two->species[DARK].pot, (size_t)rows.n * sizeof(float));
        sim_free(one);
        sim_free(two);
        mem_free(text);
    }
    rows_free(rows);
}

/* Two rows that become one at the middle: the change of potential energy in the field of all others. */
static void check_field(const struct sim *sim)
{
    const struct species *s = &sim->species[DARK];
    const struct gravity *g = sim_state(sim, "gravity");
    for (int64_t i = 1; i < s->n; i += 300) {
        const int64_t two[2] = {i - 1, i};
        struct gravity_piece piece[3] = {{DARK, -s->mass[i - 1], {0}}, {DARK, -s->mass[i], {0}}, {DARK, s->mass[i - 1] + s->mass[i], {0}}};
        double sum = 0, size = 0;
        for (int x = 0; x < 3; x++) {
            piece[0].pos[x] = s->pos[i - 1][x];
            piece[1].pos[x] = s->pos[i][x];
            piece[2].pos[x] = 0.5 * (s->pos[i - 1][x] + s->pos[i][x]);
        }
        for (int64_t j = 0; j < s->n; j++)
            for (int p = 0; p < 3 && j != i && j != i - 1; p++) {
                double r2 = 0;
                for (int x = 0; x < 3; x++) r2 += (s->pos[j][x] - piece[p].pos[x]) * (s->pos[j][x] - piece[p].pos[x]);
                double depth = (double)pair_any(g->form, r2, s->mass[j], g->half_soft2[DARK] + g->half_soft2[DARK]).depth;
                sum -= g->G * piece[p].mass * depth;
                size += g->G * fabs(piece[p].mass) * depth;
            }
        double got = gravity_field(sim, piece, 3, DARK, two);
        if (!(fabs(got - sum) <= 0.05 * fabs(sum) + 1e-6 * size)) fail_msg("row %d: %g, not %g", (int)i, got, sum);
    }
}

/* What another softening makes of a row's potential, against the sum over all rows. */
static void test_resoften(void **unused)
{
    (void)unused;
    const char *const settings[] = {"softening=0.05 softening_star=0.2", "softening=0.2 softening_star=0.05",
                                    "softening=0.05 softening_star=0.2 softening_kernel=spline"};
    struct rows rows = rows_make(3000);
    for (size_t k = 0; k < sizeof settings / sizeof *settings; k++) {
        struct sim *sim = rows_forces(rows, settings[k]);
        const struct species *s = &sim->species[DARK];
        const struct gravity *g = sim_state(sim, "gravity");
        for (int64_t i = 0; i < s->n; i += 100) {
            double sum = 0;
            for (int64_t j = 0; j < s->n; j++) {
                double r2 = 0;
                for (int x = 0; x < 3; x++) r2 += (s->pos[j][x] - s->pos[i][x]) * (s->pos[j][x] - s->pos[i][x]);
                if (j != i) sum += pair_any(g->form, r2, s->mass[j], g->half_soft2[DARK] + g->half_soft2[DARK]).depth -
                                   pair_any(g->form, r2, s->mass[j], g->half_soft2[DARK] + g->half_soft2[STAR]).depth;
            }
            double got = gravity_resoften(sim, DARK, i, STAR);
            if (!(fabs(got - sum) <= 0.03 * fabs(sum) + 1e-12)) fail_msg("%s, row %d: %g, not %g", settings[k], (int)i, got, sum);
        }
        assert_true(gravity_resoften(sim, DARK, 0, DARK) == 0);
        check_field(sim);
        sim_free(sim);
    }
    rows_free(rows);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs), cmocka_unit_test(test_kernels), cmocka_unit_test(test_orders),
        cmocka_unit_test(test_shifts), cmocka_unit_test(test_errors_fall), cmocka_unit_test(test_accuracy),
        cmocka_unit_test(test_momentum), cmocka_unit_test(test_momentum_of_walks), cmocka_unit_test(test_threads),
        cmocka_unit_test(test_resoften),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
