/* SPDX-License-Identifier: GPL-3.0-or-later
 * The converged solution of the Evrard collapse, of which tests/data/evrard_*.csv were made: a
 * spherical Lagrangian code with staggered mesh and artificial viscosity (von Neumann & Richtmyer
 * 1950; Richtmyer & Morton 1967, chapter 12; q = rho (2 dv^2 + 0.3 c |dv|) in compression), zones of
 * equal width at the start. G = M = R = 1, rho = 1/(2 pi r), u = 0.05, gamma = 5/3.
 * Not part of the program: cc -O3 -march=native tests/reference_evrard.c -lm; ./a.out 4000 0.8 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double gamma_gas = 5.0 / 3, quadratic = 2, linear = 0.3, courant = 0.05;

struct mesh {
    int n;              /* zones; zone i lies between nodes i and i + 1 */
    double *r, *v;      /* nodes; v half a step behind */
    double *m, *inside; /* mass of a zone, within a node */
    double *rho, *u, *p, *q;
    double time, dt;
};

static double *row(int n) { return calloc((size_t)n + 1, sizeof(double)); }

static double volume(const struct mesh *z, int i)
{
    double a = z->r[i], b = z->r[i + 1];
    return 4 * M_PI / 3 * (b - a) * (b * b + a * b + a * a);
}

static void start(struct mesh *z, int n)
{
    *z = (struct mesh){n, row(n), row(n), row(n), row(n), row(n), row(n), row(n), row(n), 0, 0};
    for (int i = 0; i <= n; i++) {
        z->r[i] = (double)i / n;
        z->inside[i] = z->r[i] * z->r[i];
    }
    for (int i = 0; i < n; i++) {
        z->m[i] = z->inside[i + 1] - z->inside[i];
        z->rho[i] = z->m[i] / volume(z, i);
        z->u[i] = 0.05;
        z->p[i] = (gamma_gas - 1) * z->rho[i] * z->u[i];
    }
}

static double longest_step(const struct mesh *z)
{
    double dt = 1e-3;
    for (int i = 0; i < z->n; i++) {
        double c = sqrt(gamma_gas * z->p[i] / z->rho[i]), dv = fabs(z->v[i + 1] - z->v[i]);
        double width = z->r[i + 1] - z->r[i];
        dt = fmin(dt, courant * width / (c + (1 + 4 * quadratic) * dv));
    }
    return z->dt > 0 ? fmin(dt, 1.05 * z->dt) : 1e-7;
}

static void step(struct mesh *z, double dt)
{
    const double kick = 0.5 * (z->dt + dt);     /* from the last half step to the next */
    for (int i = 1; i <= z->n; i++) {
        double outer = i < z->n ? z->p[i] + z->q[i] : 0, half = 0.5 * (z->m[i - 1] + (i < z->n ? z->m[i] : 0));
        double r2 = z->r[i] * z->r[i];
        z->v[i] += kick * (-4 * M_PI * r2 * (outer - z->p[i - 1] - z->q[i - 1]) / half - z->inside[i] / r2);
    }
    for (int i = 1; i <= z->n; i++) z->r[i] += dt * z->v[i];
    for (int i = 0; i < z->n; i++) {
        double rho = z->m[i] / volume(z, i), dv = z->v[i + 1] - z->v[i];
        double squeeze = 1 / rho - 1 / z->rho[i], c = sqrt(gamma_gas * z->p[i] / z->rho[i]);
        double q = dv < 0 ? 0.5 * (rho + z->rho[i]) * (quadratic * dv * dv - linear * c * dv) : 0;
        /* du = -(mean p + q) d(1/rho), with the new pressure in the mean */
        z->u[i] = (z->u[i] - (0.5 * z->p[i] + q) * squeeze) / (1 + 0.5 * (gamma_gas - 1) * rho * squeeze);
        z->rho[i] = rho;
        z->q[i] = q;
        z->p[i] = (gamma_gas - 1) * rho * z->u[i];
    }
    z->dt = dt;
    z->time += dt;
}

static void print_energies(const struct mesh *z)
{
    double kinetic = 0, thermal = 0, potential = 0;
    for (int i = 1; i <= z->n; i++) {
        double half = 0.5 * (z->m[i - 1] + (i < z->n ? z->m[i] : 0));
        kinetic += 0.5 * half * z->v[i] * z->v[i];
        potential -= half * z->inside[i] / z->r[i];
    }
    for (int i = 0; i < z->n; i++) thermal += z->m[i] * z->u[i];
    fprintf(stderr, "%.3f,%.5f,%.5f,%.5f,%.5f\n", z->time, kinetic, thermal, potential, kinetic + thermal + potential);
}

int main(int argc, char **argv)
{
    const double end = argc > 2 ? atof(argv[2]) : 0.8;
    struct mesh z;
    start(&z, argc > 1 ? atoi(argv[1]) : 2000);
    for (double next = 0; z.time < end * (1 - 1e-12);) {
        double dt = longest_step(&z);
        if (z.time + dt > end) dt = end - z.time;
        step(&z, dt);
        if (z.time >= next) {
            print_energies(&z);
            next += argc > 3 ? atof(argv[3]) : 0.1;
        }
    }
    printf("r,density,radial_velocity,pressure,internal_energy\n");
    for (double wanted = 0.0125, last = 0; wanted < 1; wanted *= 1.03)
        for (int i = 0; i < z.n; i++) {
            double r = 0.5 * (z.r[i] + z.r[i + 1]);
            if (r < wanted || r <= last) continue;
            printf("%.5f,%.5g,%.5g,%.5g,%.5g\n", r, z.rho[i], 0.5 * (z.v[i] + z.v[i + 1]), z.p[i], z.u[i]);
            last = r;
            break;
        }
    return 0;
}
