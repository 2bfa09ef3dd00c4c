/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spherical equilibria (equilibrium.h). */
#include "equilibrium.h"
#include "lattice.h"
#include "mem.h"
#include "random.h"
#include <math.h>

enum { N = EQUILIBRIUM_POINTS };
static const double PI = 3.14159265358979323846;

static double radius_of(const struct equilibrium *all, int i) { return exp(all->first + all->step * i); }

struct equilibrium *equilibrium_new(double G, const struct radial *parts, int n)
{
    const double nearest = 1e-5;    /* radii: a Hernquist sphere has 1e-10 of its mass within */
    struct equilibrium *all = mem_alloc("generator", sizeof *all);
    double low = INFINITY, high = 0;
    all->n = n;
    all->G = G;
    for (int k = 0; k < n; k++) {
        all->part[k] = parts[k];
        radial_prepare(&all->part[k]);
        low = fmin(low, nearest * parts[k].radius);
        high = fmax(high, radial_end(&parts[k]));
    }
    all->first = log(low);
    all->step = log(high / low) / (N - 1);
    for (int i = 0; i < N; i++) {
        double r = radius_of(all, i), outer = 0;
        for (int k = 0; k < n; k++) {
            struct radial_point at = radial_at(&all->part[k], r);
            all->mass[i] += at.mass;
            all->rho[i] += at.rho;
            outer += at.outer;
        }
        all->psi[i] = G * (all->mass[i] / r + outer);
    }
    return all;
}

static void begin_part(const struct equilibrium *all, int k, struct equilibrium_part *part)
{
    part->all = all;
    part->profile = &all->part[k];
    part->total = radial_at(part->profile, radius_of(all, N - 1)).mass;
    for (int i = 0; i < N; i++) part->mass[i] = log(radial_at(part->profile, radius_of(all, i)).mass / part->total);
}

/* d2 rho/dpsi2 at a point of the table, from the derivatives by r and dpsi/dr = -G M/r^2. */
static double second_derivative(const struct equilibrium *all, const struct radial *profile, int i)
{
    const double r = radius_of(all, i), pull = all->G * all->mass[i] / (r * r);
    struct radial_point at = radial_at(profile, r);
    double bend = 2 / r - 4 * PI * r * r * all->rho[i] / all->mass[i];
    return at.rho * (at.slope * at.slope + at.bend + at.slope * bend) / (pull * pull);
}

/* f at the energy psi[j]: the integral of g dpsi/sqrt(E - psi) from the outside in, exact for a g that is linear in
 * psi between two points. `size` is what it would be if no part of g were negative. */
static double invert(const double *psi, const double *g, int j, double *size)
{
    double sum = 0;
    *size = 0;
    for (int i = j; i < N - 1; i++) {
        double a = sqrt(psi[j] - psi[i]), b = sqrt(psi[j] - psi[i + 1]), width = psi[i] - psi[i + 1];
        if (!(a + b > 0)) continue;
        double part = 2 * width / (a + b) * (g[i + 1] + (g[i] - g[i + 1]) * (2 * b + a) / (3 * (a + b)));
        sum += part;
        *size += fabs(part);
    }
    const double factor = 1 / (sqrt(8.0) * PI * PI);
    *size *= factor;
    return factor * sum;
}

/* f at any energy, linear between points; psi falls with the index. */
static double at_energy(const struct equilibrium_part *part, double energy)
{
    const double *psi = part->all->psi;
    if (!(energy > psi[N - 1])) return 0;
    int low = 0, high = N - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (psi[middle] >= energy) low = middle;
        else high = middle;
    }
    double along = fmin(1, (energy - psi[high]) / (psi[low] - psi[high]));
    return part->f[high] + along * (part->f[low] - part->f[high]);
}

/* For the rejection below: the largest value found on a grid in q, and a little more. */
static double largest(const struct equilibrium_part *part, double psi)
{
    enum { STEPS = 100 };
    const double margin = 1.05;
    double most = 0;
    for (int s = 1; s < STEPS; s++) {
        double q = (double)s / STEPS;
        most = fmax(most, q * q * at_energy(part, psi * (1 - q * q)));
    }
    return margin * most;
}

bool equilibrium_velocities(const struct equilibrium *all, int k, struct equilibrium_part *part)
{
    const double rounding = 1e-3;   /* of the sum's own parts: below that a negative f is one */
    double *g = mem_array("generator", double, N);
    bool positive = true;
    begin_part(all, k, part);
    for (int i = 0; i < N; i++) g[i] = second_derivative(all, part->profile, i) / part->total;
    for (int j = 0; j < N; j++) {
        double size, f = invert(all->psi, g, j, &size);
        positive &= f >= -rounding * size;
        part->f[j] = fmax(f, 0);
    }
    for (int i = 0; i < N; i++) part->most[i] = largest(part, all->psi[i]);
    mem_free(g);
    return positive;
}

/* P(r) is the weight of what lies outside: the integral of rho G M/r^2 dr. */
void equilibrium_temperatures(const struct equilibrium *all, int k, struct equilibrium_part *part)
{
    begin_part(all, k, part);
    double pressure = 0, before = 0;
    for (int i = N - 1; i >= 0; i--) {
        double r = radius_of(all, i), rho = radial_at(part->profile, r).rho, weight = rho * all->G * all->mass[i] / r;
        if (i < N - 1) pressure += 0.5 * (weight + before) * all->step;
        before = weight;
        part->u[i] = rho > 0 ? pressure / rho : 0;
    }
}

/* Place in the table of the radius that holds the given part of the mass: linear in the logarithms. */
static double place_of(const struct equilibrium_part *part, double inside)
{
    double wanted = log(inside);
    int low = 0, high = N - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (part->mass[middle] <= wanted) low = middle;
        else high = middle;
    }
    double width = part->mass[high] - part->mass[low];
    return low + (width > 0 ? (wanted - part->mass[low]) / width : 0);
}

static double between(const double *table, double place)
{
    int i = place < 0 ? 0 : place >= N - 2 ? N - 2 : (int)place;
    double along = fmin(1, fmax(0, place - i));
    return table[i] + along * (table[i + 1] - table[i]);
}

/* The speed over that of escape, by rejection under q^2 f(psi (1 - q^2)). */
static double speed(const struct equilibrium_part *part, double place, const struct random *key)
{
    int i = place < 0 ? 0 : place >= N - 2 ? N - 2 : (int)place;
    double psi = between(part->all->psi, place), most = fmax(part->most[i], part->most[i + 1]);
    for (uint64_t draw = 6;; draw += 2) {
        double q = random_uniform(key, draw);
        if (most * random_uniform(key, draw + 1) <= q * q * at_energy(part, psi * (1 - q * q))) return q * sqrt(2 * psi);
    }
}

void equilibrium_fill(const struct equilibrium_part *part, struct rows rows, uint64_t seed, uint64_t stream)
{
#pragma omp parallel for schedule(static, 1024)
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {seed, (uint64_t)i + 1, 0, stream};
        double *pos = rows.table->pos[rows.first + i], *vel = rows.table->vel[rows.first + i];
        double place = place_of(part, random_uniform(&key, 0)), r = exp(part->all->first + part->all->step * place);
        double v = speed(part, place, &key);
        random_direction(&key, 1, pos);
        random_direction(&key, 2, vel);
        for (int k = 0; k < 3; k++) {
            pos[k] *= r;
            vel[k] *= v;
        }
    }
    rows_rest(rows);
}

void equilibrium_fill_gas(const struct equilibrium_part *part, struct rows rows, double gamma)
{
    double (*ball)[3] = lattice_ball(rows.n);
    struct species *gas = rows.table;
#pragma omp parallel for
    for (int64_t i = 0; i < rows.n; i++) {
        double s = sqrt(ball[i][0] * ball[i][0] + ball[i][1] * ball[i][1] + ball[i][2] * ball[i][2]);
        double place = place_of(part, fmin(s * s * s, 1 - 0.5 / (double)rows.n));
        double r = exp(part->all->first + part->all->step * place);
        for (int k = 0; k < 3; k++) gas->pos[rows.first + i][k] = ball[i][k] * r / s;
        if (gas->u) gas->u[rows.first + i] = (float)(between(part->u, place) / (gamma - 1));
    }
    mem_free(ball);
}
