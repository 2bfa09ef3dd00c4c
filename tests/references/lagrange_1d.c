/* SPDX-License-Identifier: GPL-3.0-or-later
 * Spherical Lagrangian hydrodynamics in one dimension on a staggered mesh with the viscosity of von Neumann
 * & Richtmyer (1950, J. Appl. Phys. 21, 232) in the form q = rho (q2 dv^2 + q1 c |dv|) where a zone is
 * compressed. A step is a predictor and a corrector that share the work of each force between the two
 * energies (Caramana et al. 1998, J. Comput. Phys. 146, 227): the total is kept but for rounding and the
 * O(dt^3) of gravity, whose force over a step is G M / (r r') exactly. */
#include "lagrange_1d.h"
#include "mem.h"
#include <math.h>

static const double PI = 3.14159265358979323846;

static double cube(double x) { return x * x * x; }

static double zone_density(const struct lagrange *l, const double *r, int i)
{
    return l->mass[i] / (4.0 / 3.0 * PI * (cube(r[i + 1]) - cube(r[i])));
}

static double sound_speed(const struct lagrange *l, double u) { return sqrt(l->gamma * (l->gamma - 1.0) * u); }

struct lagrange *lagrange_evrard(int zones)
{
    struct lagrange *l = mem_alloc("test", sizeof *l);
    *l = (struct lagrange){.n = zones, .gamma = 5.0 / 3.0, .G = 1.0, .quadratic = 2.0, .linear = 0.3, .courant = 0.3};
    double **const column[] = {&l->r, &l->v, &l->node_mass, &l->inside, &l->mass, &l->rho, &l->u, &l->p,
                               &l->r_new, &l->v_new, &l->u_new, &l->rho_new};
    for (unsigned c = 0; c < sizeof column / sizeof *column; c++) *column[c] = mem_array("test", double, zones + 1);
    for (int j = 0; j <= zones; j++) {
        l->r[j] = (double)j / zones;
        l->inside[j] = l->r[j] * l->r[j];
    }
    for (int i = 0; i < zones; i++) {
        l->mass[i] = l->inside[i + 1] - l->inside[i];
        l->node_mass[i] += 0.5 * l->mass[i];
        l->node_mass[i + 1] += 0.5 * l->mass[i];
        l->rho[i] = zone_density(l, l->r, i);
        l->u[i] = 0.05;
    }
    return l;
}

void lagrange_free(struct lagrange *l)
{
    double *const column[] = {l->r, l->v, l->node_mass, l->inside, l->mass, l->rho, l->u, l->p,
                              l->r_new, l->v_new, l->u_new, l->rho_new};
    for (unsigned c = 0; c < sizeof column / sizeof *column; c++) mem_free(column[c]);
    mem_free(l);
}

static double viscosity(const struct lagrange *l, double rho, double u, double dv)
{
    return dv < 0.0 ? rho * dv * (l->quadratic * dv - l->linear * sound_speed(l, u)) : 0.0;
}

/* Sound, and the viscosity's diffusion, may cross a part of each zone; no zone may lose more than a part of its width. */
static double longest_step(const struct lagrange *l)
{
    double longest = INFINITY;
    for (int i = 0; i < l->n; i++) {
        double width = l->r[i + 1] - l->r[i], dv = l->v[i + 1] - l->v[i];
        double speed = sound_speed(l, l->u[i]) + (dv < 0.0 ? -4.0 * l->quadratic * dv : dv);
        longest = fmin(longest, width / speed);
    }
    return l->courant * longest;
}

/* Mean of r^2 along the path of a node: times its way it gives the volume that it sweeps. */
static double mean_square(double a, double b) { return (a * a + a * b + b * b) / 3.0; }

/* From the pressures in p, the state at the end; r_new is the estimate that the areas are taken from. */
static void pass(struct lagrange *l, double dt)
{
    double swept = 0.0, outside = 0.0;
    for (int j = 1; j <= l->n; j++) {
        double area = 4.0 * PI * mean_square(l->r[j], l->r_new[j]);
        double force = area * (l->p[j - 1] - (j < l->n ? l->p[j] : outside));
        double gravity = l->G * l->inside[j] / (l->r[j] * l->r_new[j]);
        l->v_new[j] = l->v[j] + dt * (force / l->node_mass[j] - gravity);
        double way = 0.5 * dt * (l->v[j] + l->v_new[j]), sweeps = area * way;
        l->r_new[j] = l->r[j] + way;
        l->u_new[j - 1] = l->u[j - 1] - l->p[j - 1] * (sweeps - swept) / l->mass[j - 1];
        swept = sweeps;
    }
    for (int i = 0; i < l->n; i++) l->rho_new[i] = zone_density(l, l->r_new, i);
}

void lagrange_step(struct lagrange *l, double end)
{
    double dt = fmin(longest_step(l), end - l->time);
    for (int j = 0; j <= l->n; j++) {
        l->r_new[j] = l->r[j] + dt * l->v[j];
        l->v_new[j] = l->v[j];
    }
    for (int i = 0; i < l->n; i++)
        l->p[i] = (l->gamma - 1.0) * l->rho[i] * l->u[i] + viscosity(l, l->rho[i], l->u[i], l->v[i + 1] - l->v[i]);
    pass(l, dt);
    for (int i = 0; i < l->n; i++) {
        double rho = 0.5 * (l->rho[i] + l->rho_new[i]), u = 0.5 * (l->u[i] + l->u_new[i]);
        double dv = 0.5 * (l->v[i + 1] - l->v[i] + l->v_new[i + 1] - l->v_new[i]);
        l->p[i] = (l->gamma - 1.0) * rho * u + viscosity(l, rho, u, dv);
    }
    pass(l, dt);
    double *swap[4] = {l->r, l->v, l->u, l->rho};
    l->r = l->r_new;
    l->v = l->v_new;
    l->u = l->u_new;
    l->rho = l->rho_new;
    l->r_new = swap[0];
    l->v_new = swap[1];
    l->u_new = swap[2];
    l->rho_new = swap[3];
    l->time += dt;
    l->steps++;
}

void lagrange_advance(struct lagrange *l, double end)
{
    while (l->time < end * (1.0 - 1e-15)) lagrange_step(l, end);
}

struct lagrange_energies lagrange_energies(const struct lagrange *l)
{
    struct lagrange_energies e = {0};
    for (int i = 0; i < l->n; i++) e.thermal += l->mass[i] * l->u[i];
    for (int j = 1; j <= l->n; j++) {
        e.kinetic += 0.5 * l->node_mass[j] * l->v[j] * l->v[j];
        e.potential -= l->G * l->node_mass[j] * l->inside[j] / l->r[j];
    }
    return e;
}

double lagrange_shock(const struct lagrange *l, double *inside)
{
    int at = 0;
    for (int i = 1; i < l->n; i++)
        if (l->v[i + 1] - l->v[i] < l->v[at + 1] - l->v[at]) at = i;
    *inside = 0.5 * (l->inside[at] + l->inside[at + 1]);
    return 0.5 * (l->r[at] + l->r[at + 1]);
}
