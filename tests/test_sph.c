/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPH against double-precision brute force: kernels, smoothing lengths on sets that break searches,
 * density, derivatives and forces with sleeping rows, conservation, threads, instruction sets. */
#include "integrate.h"
#include "isa.h"
#include "sph_case.h"
#include <omp.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

/* Kernels. */

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
    const struct sph_viscosity visc = {1, 2, 0.01f, 1};
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

/* Sets of rows. */

static void clustered(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    case_random(pos, vel, i, n, key);
    double scale = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.01 : 1e-5;
    for (int d = 0; d < 3; d++) pos[d] = (double)(i % 3) + scale * (pos[d] - 0.5);
}

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

static void lattice(double pos[3], double vel[3], int64_t i, int64_t n, const struct random *key)
{
    int64_t side = llround(cbrt((double)n));
    (void)key;
    pos[0] = (double)(i % side) / (double)side;
    pos[1] = (double)(i / side % side) / (double)side;
    pos[2] = (double)(i / side / side) / (double)side;
    vel[0] = vel[1] = vel[2] = 0;
}

/* Brute force, all rows now. */

struct now { double pos[3], vel[3], u, h, rho; };

static struct now row_now(const struct sim *sim, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    struct now now = {.u = gas->u ? (double)gas->u[i] : 0, .h = (double)sph_h_now(sim, i), .rho = (double)sph_rho_now(sim, i)};
    double t = timeline_lag(&sim->time, gas->rung[i], gas->rung0[i]);
    for (int d = 0; d < 3; d++) {
        now.pos[d] = integrate_position(gas->pos[i][d], gas->vel[i][d], (double)gas->acc[i][d], t);
        now.vel[d] = integrate_velocity(gas->vel[i][d], (double)gas->acc[i][d], t);
    }
    if (gas->u) now.u = (double)integrate_energy(gas->u[i], gas->du[i], (float)t);
    if (t > 0 && case_sph(sim)->equation == SPH_ENTROPY) now.u *= exp(-(case_sph(sim)->gamma - 1) * (double)gas->div_v[i] * t);
    return now;
}

static double distance2(const struct now *a, const struct now *b)
{
    double sum = 0;
    for (int d = 0; d < 3; d++) sum += (a->pos[d] - b->pos[d]) * (a->pos[d] - b->pos[d]);
    return sum;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct now *all_now(const struct sim *sim)
{
    int64_t n = sim->species[GAS].n;
    struct now *now = mem_array("test", struct now, n);
    for (int64_t i = 0; i < n; i++) now[i] = row_now(sim, i);
    return now;
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

#define GRAD_H "sph.count=smooth", "sph.grad_h=on"
static const char *const variants[][8] = {
    {NULL}, {GRAD_H, "sph.equation=entropy", "sph.kernel=wendland_c2", "sph.neighbours=100", "sph.strength=shocks", NULL},
    {GRAD_H, NULL}, {GRAD_H, "sph.viscosity=signal", "sph.kernel=wendland_c4", "sph.balsara=off", NULL},
    {"sph.preset=modern", NULL},
    {"sph.viscosity=signal", "sph.kernel=wendland_c4", "sph.neighbours=200", "sph.strength=shocks", "sph.balsara=off", NULL},
};
enum { VARIANTS = sizeof variants / sizeof *variants };

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

/* Density and forces. */

struct sums { double rho, div, curl[3], omega, acc[3], du, signal, size; };

/* A pair: distance, mean of h and of the sound speeds, (v_i - v_j) . (x_i - x_j) and its parts. */
struct pair { double r, h, c, vr, x[3], v[3]; };

static struct pair pair_of(const struct sph *sph, const struct now *a, const struct now *b)
{
    struct pair pair = {.r = sqrt(distance2(a, b)), .h = 0.5 * (a->h + b->h)};
    double g = sph->gamma * (sph->gamma - 1);
    pair.c = 0.5 * (sqrt(g * a->u) + sqrt(g * b->u));
    for (int d = 0; d < 3; d++) {
        pair.x[d] = a->pos[d] - b->pos[d];
        pair.v[d] = a->vel[d] - b->vel[d];
        pair.vr += pair.v[d] * pair.x[d];
    }
    return pair;
}

static double viscous(const struct sim *sim, const struct now *now, int64_t i, int64_t j, struct pair pair)
{
    const struct species *gas = &sim->species[GAS];
    const struct sph *sph = case_sph(sim);
    double mu = pair.h * pair.vr / (pair.r * pair.r + sph->epsilon * pair.h * pair.h), rho = 0.5 * (now[i].rho + now[j].rho);
    if (sph->viscosity == SPH_SIGNAL) mu = pair.vr / pair.r;
    if (pair.vr >= 0) return 0;
    double factor = gas->balsara ? 0.5 * (double)(gas->balsara[i] + gas->balsara[j]) : 1;
    return factor * (sph->beta * mu * mu - sph->alpha * pair.c * mu) / rho;
}

static double weight(const struct sph *sph, double r, double h)
{
    return (double)sph_kernel((float)(r / h), sph->kernel) / (h * h * h);
}

/* dW/dr over r. */
static double steep(const struct sph *sph, double r, double h)
{
    return r < 2 * h ? (double)sph_kernel_slope((float)(r / h), sph->kernel) / (h * h * h * h * r) : 0;
}

static void add_density(struct sums *s, const struct sph *sph, const struct now *a, double mass, struct pair pair)
{
    double h = sph->grad_h ? a->h : pair.h;
    s->rho += mass * weight(sph, pair.r, h);
    if (pair.r == 0) return;
    double slope = mass * steep(sph, pair.r, h);
    s->omega -= slope * pair.r * pair.r;
    s->div -= slope * pair.vr;
    for (int d = 0; d < 3; d++)
        s->curl[d] += slope * (pair.v[(d + 1) % 3] * pair.x[(d + 2) % 3] - pair.v[(d + 2) % 3] * pair.x[(d + 1) % 3]);
}

static double pressure_term(const struct sim *sim, const struct now *now, int64_t i)
{
    const struct sph *sph = case_sph(sim);
    return (sph->gamma - 1) * now[i].u / (now[i].rho * (sph->grad_h ? (double)sim->species[GAS].omega[i] : 1));
}

static void add_force(struct sums *s, const struct sim *sim, const struct now *now, int64_t i, int64_t j, struct pair pair)
{
    const struct sph *sph = case_sph(sim);
    double mass = sim->species[GAS].mass[j], mean = steep(sph, pair.r, pair.h);
    double near = mass * (sph->grad_h ? steep(sph, pair.r, now[i].h) : mean);
    double far = mass * (sph->grad_h ? steep(sph, pair.r, now[j].h) : mean);
    if (pair.r == 0 || (near == 0 && far == 0)) return;
    double own = pressure_term(sim, now, i) * near, other = pressure_term(sim, now, j) * far;
    double rub = 0.5 * (near + far) * viscous(sim, now, i, j, pair), all = own + other + rub;
    for (int d = 0; d < 3; d++) s->acc[d] -= all * pair.x[d];
    if (sph->grad_h) s->du += pair.vr * ((sph->equation == SPH_ENERGY ? own : 0) + 0.5 * rub);
    else s->du += pair.vr * (pair.vr > 0 ? own : 0.5 * all);
    s->size += fabs(all) * pair.r;
    s->signal = fmax(s->signal, 2 * pair.c - 3 * fmin(pair.vr, 0) / pair.r);
}

static struct sums brute_sums(const struct sim *sim, const struct now *now, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    const struct sph *sph = case_sph(sim);
    struct sums s = {.signal = 2 * sqrt(sph->gamma * (sph->gamma - 1) * now[i].u)};
    for (int64_t j = 0; j < gas->n; j++) {
        struct pair pair = pair_of(sph, &now[i], &now[j]);
        add_density(&s, sph, &now[i], gas->mass[j], pair);
        add_force(&s, sim, now, i, j, pair);
    }
    s.rho -= (double)sph->excess * gas->mass[i] / pow(now[i].h, 3);
    s.omega = sph->grad_h ? fmax(s.omega / (3 * s.rho), 0.1) : 1;
    return s;
}

static void check_sums(const struct sim *sim, const struct now *now, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    struct sums s = brute_sums(sim, now, i);
    double scale = 1 / (s.rho * s.omega), x = s.curl[0] * scale, y = s.curl[1] * scale, z = s.curl[2] * scale;
    double curl = sqrt(x * x + y * y + z * z), change = (fabs(s.div) * scale + curl) + 1;
    assert_float_equal((double)gas->rho[i] / s.rho, 1, 3e-6);
    if (gas->omega) assert_float_equal((double)gas->omega[i], s.omega, 1e-5);
    assert_float_equal((double)gas->div_v[i], s.div * scale, 1e-5 * change);
    assert_float_equal((double)gas->curl_v[i], curl, 1e-5 * change);
    for (int d = 0; d < 3; d++) assert_float_equal((double)gas->acc[i][d], s.acc[d], 1e-5 * s.size);
    assert_float_equal((double)gas->du[i], s.du, 3e-5 * s.size);
    assert_float_equal((double)gas->signal[i], s.signal, 1e-5 * s.signal);
}

static void sums_agree_with_brute_force(void **state)
{
    (void)state;
    case_maker *const makers[] = {case_random, case_evrard, clustered};
    for (int m = 0; m < 3 * VARIANTS; m++) {
        struct sim *sim = case_new(2500, makers[m % 3], variants[m / 3]);
        case_arrange(sim);
        case_density(sim);
        case_force(sim);
        struct now *now = all_now(sim);
        for (int64_t i = 0; i < 2500; i += 7) check_sums(sim, now, i);
        mem_free(now);
        case_free(sim);
    }
}

/* Puts rows to sleep, on steps that began at different ticks, moves on to a tick where few are active. */
static void put_to_sleep(struct sim *sim)
{
    struct species *gas = case_gas(sim);
    sim->time.tick = ((int64_t)1 << RUNG_TOP) - ((int64_t)1 << (RUNG_TOP - 4));
    for (int64_t i = 0; i < gas->n; i++) {
        gas->rung0[i] = gas->rung[i] = (uint8_t)(RUNG_TOP - gas->id[i] % 6);
        gas->du[i] = -gas->u[i];
    }
    tree_build(sim);
    sim_find_active(sim);
    tree_mark_active(sim);
}

static void check_sleepers(const char *const *settings)
{
    struct sim *sim = case_new(2500, case_random, settings);
    struct species *gas = case_gas(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int d = 0; d < 3; d++) gas->vel[i][d] *= 0.02;
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int d = 0; d < 3; d++) gas->acc[i][d] *= 0.01f;
    put_to_sleep(sim);
    assert_true(gas->n_active > 500 && gas->n_active < 1500);
    case_density(sim);
    case_force(sim);
    struct now *now = all_now(sim);
    for (int64_t a = 0; a < gas->n_active; a += 5) check_sums(sim, now, gas->active[a]);
    mem_free(now);
    case_free(sim);
}

static void sleeping_rows_are_predicted(void **state)
{
    (void)state;
    check_sleepers(NULL);
    check_sleepers(variants[1]);
    check_sleepers(variants[2]);
}

static void cells_know_their_largest_h(void **state)
{
    (void)state;
    struct sim *sim = case_new(2500, case_random, NULL);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    put_to_sleep(sim);
    case_density(sim);
    for (int32_t n = 0; n < sim->tree.n_nodes; n++) {
        const struct node *node = &sim->tree.node[n];
        for (int32_t i = node->first[GAS]; i < node->first[GAS] + node->count[GAS]; i++)
            assert_true(sim->tree.h_max[n] >= sph_h_now(sim, i));
    }
    case_free(sim);
}

static void a_lattice_has_its_density(void **state)
{
    (void)state;
    struct sim *sim = case_new(8000, lattice, NULL);
    case_arrange(sim);
    case_density(sim);
    const struct species *gas = case_gas(sim);
    int64_t inside = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        bool inner = true;
        for (int d = 0; d < 3; d++) inner &= gas->pos[i][d] > 0.3 && gas->pos[i][d] < 0.65;
        if (!inner) continue;
        inside++;
        assert_float_equal(gas->rho[i], 1, 0.03);
    }
    assert_true(inside > 100);
    case_free(sim);
}

static void momentum_and_energy_are_conserved(void **state)
{
    (void)state;
    case_maker *const makers[] = {case_random, case_evrard, clustered};
    for (int m = 0; m < 3 * VARIANTS; m++) {
        struct sim *sim = case_new(5000, makers[m % 3], variants[m / 3]);
        case_sph(sim)->equation = SPH_ENERGY;   /* du tells of all work then */
        const struct species *gas = case_gas(sim);
        case_arrange(sim);
        case_density(sim);
        case_force(sim);
        double force[3] = {0}, work = 0, size = 0, power = 0;
        for (int64_t i = 0; i < gas->n; i++) {
            double a2 = 0, va = 0;
            for (int d = 0; d < 3; d++) {
                force[d] += gas->mass[i] * (double)gas->acc[i][d];
                a2 += (double)gas->acc[i][d] * (double)gas->acc[i][d];
                va += gas->vel[i][d] * (double)gas->acc[i][d];
            }
            size += gas->mass[i] * sqrt(a2);
            work += gas->mass[i] * (va + (double)gas->du[i]);
            power += gas->mass[i] * (fabs(va) + fabs((double)gas->du[i]));
        }
        for (int d = 0; d < 3; d++) assert_true(fabs(force[d]) <= 1e-6 * size);
        assert_true(fabs(work) <= 1e-6 * power);
        case_free(sim);
    }
}

/* The same whatever the threads, the arena, the instruction set. */

struct result { float h[4000], rho[4000], acc[4000][3], du[4000], signal[4000]; };

static struct result *run_with(int threads, const struct sph_loops *loops, bool forget)
{
    struct sim *sim = case_new(4000, case_evrard, NULL);
    struct result *result = mem_alloc("test", sizeof *result);
    struct species *gas = case_gas(sim);
    omp_set_num_threads(threads);
    if (loops) case_sph(sim)->loops = loops;
    case_arrange(sim);
    case_density(sim);
    for (int32_t b = 0; forget && b < case_sph(sim)->n_batches; b++) case_sph(sim)->batch[b].list = -1;
    case_force(sim);
    memcpy(result->h, gas->h, sizeof result->h);
    memcpy(result->rho, gas->rho, sizeof result->rho);
    memcpy(result->acc, gas->acc, sizeof result->acc);
    memcpy(result->du, gas->du, sizeof result->du);
    memcpy(result->signal, gas->signal, sizeof result->signal);
    case_free(sim);
    return result;
}

static void threads_and_arena_change_nothing(void **state)
{
    (void)state;
    struct result *one = run_with(1, NULL, false), *two = run_with(2, NULL, false), *three = run_with(3, NULL, true);
    assert_memory_equal(one, two, sizeof *one);
    assert_memory_equal(one, three, sizeof *one);
    mem_free(one);
    mem_free(two);
    mem_free(three);
}

static void instruction_sets_agree(void **state)
{
    (void)state;
    const struct sph_loops *sets[] = {&sph_loops_v3, &sph_loops_v4};
    const bool runs[] = {isa_runs(ISA_V3), isa_runs(ISA_V4)};
    struct result *one = run_with(1, &sph_loops_v2, false);
    for (int s = 0; s < 2; s++) {
        if (!runs[s]) continue;
        struct result *two = run_with(1, sets[s], false);
        for (int i = 0; i < 4000; i++) {
            float size = fabsf(one->acc[i][0]) + fabsf(one->acc[i][1]) + fabsf(one->acc[i][2]);
            assert_float_equal(one->h[i], two->h[i], 1e-6f * one->h[i]);
            assert_float_equal(one->rho[i], two->rho[i], 3e-6f * one->rho[i]);
            for (int d = 0; d < 3; d++) assert_float_equal(one->acc[i][d], two->acc[i][d], 1e-4f * size);
        }
        mem_free(two);
    }
    mem_free(one);
}

static void isothermal_gas_has_no_energy(void **state)
{
    (void)state;
    const char *const settings[] = {"sph.eos=isothermal", "sph.sound_speed=0.3", NULL};
    struct sim *sim = case_new(2000, case_random, settings);
    struct species *gas = case_gas(sim);
    assert_null(gas->u);
    assert_null(gas->du);
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    double size = 0;
    for (int64_t i = 0; i < gas->n; i++) size += (double)fabsf(gas->acc[i][0]);
    assert_true(size > 0 && isfinite(size));
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

/* Steps. */

static void steps_of_neighbours_are_close(void **state)
{
    (void)state;
    struct sim *sim = case_new(2500, case_random, NULL);
    struct species *gas = case_gas(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int d = 0; d < 3; d++) gas->vel[i][d] *= 0.02;
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    put_to_sleep(sim);
    uint8_t before[2500];
    memcpy(before, gas->rung, sizeof before);
    int32_t hot = gas->active[gas->n_active / 2];
    gas->u[hot] = 1e8f;
    for (int64_t i = 0; i < gas->n; i++) gas->dt[i] = 1;
    case_density(sim);
    case_force(sim);
    sph_module.hook[HOOK_LIMIT](sim, case_sph(sim));
    int woken = 0;
    memcpy(gas->rung0, gas->rung, sizeof before);
    for (int64_t i = 0; i < gas->n; i++) {
        if (timeline_active(&sim->time, before[i])) gas->rung[i] = (uint8_t)timeline_rung(&sim->time, (double)gas->dt[i]);
        else woken += gas->rung[i] < before[i];
        assert_true(timeline_active(&sim->time, before[i]) || gas->rung[i] <= before[i]);
    }
    assert_true(woken > 10);
    uint8_t after[2500];
    memcpy(after, gas->rung, sizeof after);
    memcpy(gas->rung, before, sizeof before);
    memcpy(gas->rung0, before, sizeof before);
    struct now *now = all_now(sim);
    for (int64_t i = 0; i < gas->n; i++)
        for (int64_t j = 0; j < gas->n; j++) {
            double reach = 0.999 * (now[i].h + now[j].h);
            bool seen = timeline_active(&sim->time, before[i]) || after[i] < before[i];
            if (seen && distance2(&now[i], &now[j]) < reach * reach) assert_true(after[j] <= after[i] + 2);
        }
    mem_free(now);
    case_free(sim);
}

/* By a thousand times the speed of sound: the same steps and forces. */
static void check_boost(const char *const *settings)
{
    enum { ROWS = 2000 };
    static float dt[2][ROWS], acc[2][ROWS][3], du[2][ROWS];
    for (int boosted = 0; boosted < 2; boosted++) {
        struct sim *sim = case_new(ROWS, case_random, settings);
        struct species *gas = case_gas(sim);
        for (int64_t i = 0; boosted && i < gas->n; i++) gas->vel[i][0] += 1000;
        case_arrange(sim);
        case_density(sim);
        case_force(sim);
        for (int64_t i = 0; i < gas->n; i++) gas->dt[i] = 1;
        sph_module.hook[HOOK_LIMIT](sim, case_sph(sim));
        memcpy(dt[boosted], gas->dt, sizeof dt[boosted]);
        memcpy(acc[boosted], gas->acc, sizeof acc[boosted]);
        memcpy(du[boosted], gas->du, sizeof du[boosted]);
        case_free(sim);
    }
    for (int i = 0; i < ROWS; i++) {
        float size = fabsf(acc[0][i][0]) + fabsf(acc[0][i][1]) + fabsf(acc[0][i][2]);
        assert_float_equal(dt[0][i], dt[1][i], 1e-4f * dt[0][i]);
        for (int d = 0; d < 3; d++) assert_float_equal(acc[0][i][d], acc[1][i][d], 1e-3f * size);
        assert_float_equal(du[0][i], du[1][i], 1e-3f * (size + fabsf(du[0][i])));
    }
}

static void a_boost_changes_nothing(void **state)
{
    (void)state;
    for (int v = 0; v < VARIANTS; v++) check_boost(variants[v]);
}

/* Lists made before h is known serve the density too: rows that swell more than expected (here those of
 * one side) are missing from them, and their neighbours' batches must notice. */
static void lists_miss_no_row(void **unused)
{
    (void)unused;
    enum { ROWS = 20000 };
    float *rho[2], (*acc[2])[3];
    for (int fresh = 0; fresh < 2; fresh++) {
        struct sim *sim = case_new(ROWS, case_evrard, (const char *const[]){"sph.group_size=64", NULL});
        struct species *gas = case_gas(sim);
        struct sph *sph = case_sph(sim);
        case_arrange(sim);
        case_density(sim);
        for (int64_t i = 0; i < ROWS; i++)
            if (gas->pos[i][0] > 0.3)
                for (int d = 0; d < 3; d++) gas->pos[i][d] *= 1 + 0.5 * (gas->pos[i][0] - 0.3);
        case_arrange(sim);
        sph_module.hook[HOOK_H](sim, sph);
        int stale = 0, listed = 0;
        for (int32_t b = 0; b < sph->n_batches; b++) {
            stale += sph->batch[b].stale;
            listed += sph->batch[b].list >= 0 && !sph->batch[b].stale;
        }
        assert_true(stale > 20 && listed > 20 && !sph->unforeseen);
        sph->unforeseen = fresh;
        sph_module.hook[HOOK_DENSITY](sim, sph);
        case_force(sim);
        rho[fresh] = mem_array("test", float, ROWS);
        acc[fresh] = mem_alloc("test", ROWS * sizeof *acc[fresh]);
        memcpy(rho[fresh], gas->rho, ROWS * sizeof *gas->rho);
        memcpy(acc[fresh], gas->acc, ROWS * sizeof *gas->acc);
        case_free(sim);
    }
    assert_memory_equal(rho[0], rho[1], ROWS * sizeof *rho[0]);
    assert_memory_equal(acc[0], acc[1], ROWS * sizeof *acc[0]);
    for (int fresh = 0; fresh < 2; fresh++) {
        mem_free(rho[fresh]);
        mem_free(acc[fresh]);
    }
}

/* Two ranks whose border runs through groups, their parts computed one after the other on shared rows:
 * the bits of one rank. (A hook is repeated with the ones before it, which find what they found.) */
static void a_border_through_groups_changes_nothing(void **unused)
{
    (void)unused;
    enum { ROWS = 4000, BORDER = 1777 };
    struct result *whole = run_with(1, NULL, false);
    struct sim *sim = case_new(ROWS, case_evrard, NULL);
    struct species *gas = case_gas(sim);
    case_arrange(sim);
    for (int hook = HOOK_H; hook <= HOOK_FORCE; hook++)
        for (int part = 0; part < 2; part++) {
            gas->own = part ? BORDER : 0;
            gas->n_own = part ? ROWS - BORDER : BORDER;
            sim_find_active(sim);
            tree_mark_active(sim);
            for (int h = HOOK_H; h <= (hook < HOOK_DENSITY ? HOOK_H : HOOK_DENSITY); h++)
                sph_module.hook[h](sim, sim->use[0].state);
            if (hook == HOOK_FORCE) case_force(sim);
        }
    assert_memory_equal(gas->h, whole->h, sizeof whole->h);
    assert_memory_equal(gas->rho, whole->rho, sizeof whole->rho);
    assert_memory_equal(gas->acc, whole->acc, sizeof whole->acc);
    assert_memory_equal(gas->du, whole->du, sizeof whole->du);
    assert_memory_equal(gas->signal, whole->signal, sizeof whole->signal);
    mem_free(whole);
    case_free(sim);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_are_normalised),
        cmocka_unit_test(slopes_are_derivatives),
        cmocka_unit_test(pairs_are_antisymmetric),
        cmocka_unit_test(h_is_half_the_distance_of_the_last_neighbour),
        cmocka_unit_test(too_few_rows_have_an_h),
        cmocka_unit_test(h_has_a_floor),
        cmocka_unit_test(smooth_h_follows_its_equation),
        cmocka_unit_test(sums_agree_with_brute_force),
        cmocka_unit_test(sleeping_rows_are_predicted),
        cmocka_unit_test(cells_know_their_largest_h),
        cmocka_unit_test(a_lattice_has_its_density),
        cmocka_unit_test(momentum_and_energy_are_conserved),
        cmocka_unit_test(threads_and_arena_change_nothing),
        cmocka_unit_test(lists_miss_no_row),
        cmocka_unit_test(a_border_through_groups_changes_nothing),
        cmocka_unit_test(instruction_sets_agree),
        cmocka_unit_test(isothermal_gas_has_no_energy),
        cmocka_unit_test(barotropic_gas_stiffens),
        cmocka_unit_test(entropy_is_kept),
        cmocka_unit_test(strength_follows_shocks),
        cmocka_unit_test(steps_of_neighbours_are_close),
        cmocka_unit_test(a_boost_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
