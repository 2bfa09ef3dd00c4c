/* SPDX-License-Identifier: GPL-3.0-or-later
 * SPH against double-precision brute force: density, derivatives and forces, with sleeping rows; conservation. */
#include "sph_brute.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

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

static double omega_of(const struct sim *sim, int64_t i) { return sim->species[GAS].omega ? (double)sim->species[GAS].omega[i] : 1; }

static double pressure_term(const struct sim *sim, const struct now *now, int64_t i)
{
    const struct sph *sph = case_sph(sim);
    return (sph->gamma - 1) * now[i].u / (now[i].rho * omega_of(sim, i));
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
    double jump = fabs(now[i].u * now[i].rho / omega_of(sim, i) - now[j].u * now[j].rho / omega_of(sim, j)) * (sph->gamma - 1);
    double speed = sqrt(2 * jump / (now[i].rho + now[j].rho)), spread = sph->conduction * speed * (now[i].u - now[j].u) * pair.r;
    double conducted = (near + far) * spread / (now[i].rho + now[j].rho);
    s->du += conducted;
    s->size += fabs(all) * pair.r + fabs(conducted);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_agree_with_brute_force),
        cmocka_unit_test(sleeping_rows_are_predicted),
        cmocka_unit_test(a_lattice_has_its_density),
        cmocka_unit_test(momentum_and_energy_are_conserved),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
