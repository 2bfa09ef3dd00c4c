/* SPDX-License-Identifier: GPL-3.0-or-later
 * The reference solutions as a program, for scripts and plots. Exact flows are asked for at the
 * coordinates on standard input; all answers are CSV. */
#include "ics/exact.h"
#include "lagrange_1d.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct flow { const char *name, *arguments; int n; struct exact_state (*at)(const double *a, double x); };

/* The arguments are those of the line of usage. */
static struct exact_state riemann_at(const double *a, double x)
{
    struct exact_state left = {a[2], a[3], a[4]}, right = {a[5], a[6], a[7]};
    struct exact_riemann r = exact_riemann(a[0], left, right);
    return exact_riemann_at(&r, x / a[1]);
}

static struct exact_state sedov_at(const double *a, double r) { return exact_sedov_at(&(struct exact_sedov){a[0], 0}, r); }
static struct exact_state noh_at(const double *a, double r) { return exact_noh(a[0], r, a[1]); }
static struct exact_state wave_at(const double *a, double x) { return exact_wave(a[0], a[1], x, a[2]); }

static const struct flow flows[] = {
    {"riemann", "GAMMA TIME RHO V P (left) RHO V P (right)", 8, riemann_at},
    {"sedov", "GAMMA: where the radius of the shock, the density outside and the time are 1", 1, sedov_at},
    {"noh", "GAMMA TIME", 2, noh_at},
    {"wave", "GAMMA AMPLITUDE TIME", 3, wave_at},
};
enum { N_FLOWS = sizeof flows / sizeof *flows, MOST = 8 };

static int print_flow(const struct flow *flow, char **argv)
{
    double a[MOST], x;
    for (int k = 0; k < flow->n; k++) a[k] = atof(argv[k]);
    printf("x,rho,v,p\n");
    while (scanf("%lf", &x) == 1) {
        struct exact_state s = flow->at(a, x);
        printf("%.10g,%.10g,%.10g,%.10g\n", x, s.rho, s.v, s.p);
    }
    return 0;
}

static int print_profile(int zones, double time)
{
    struct lagrange *l = lagrange_evrard(zones);
    lagrange_advance(l, time);
    printf("r,rho,v,p,u,inside\n");
    for (int i = 0; i < zones; i++)
        printf("%.8g,%.8g,%.8g,%.8g,%.8g,%.8g\n", 0.5 * (l->r[i] + l->r[i + 1]), l->rho[i], 0.5 * (l->v[i] + l->v[i + 1]),
               (l->gamma - 1.0) * l->rho[i] * l->u[i], l->u[i], 0.5 * (l->inside[i] + l->inside[i + 1]));
    lagrange_free(l);
    return 0;
}

static int print_energies(int zones, double end, double every)
{
    struct lagrange *l = lagrange_evrard(zones);
    printf("t,kinetic,thermal,potential,total,shock,inside\n");
    for (int k = 0; k * every < end * (1.0 + 1e-12); k++) {
        double inside, shock;
        lagrange_advance(l, k * every);
        struct lagrange_energies e = lagrange_energies(l);
        shock = lagrange_shock(l, &inside);
        printf("%.8g,%.8g,%.8g,%.8g,%.10g,%.6g,%.6g\n", l->time, e.kinetic, e.thermal, e.potential,
               e.kinetic + e.thermal + e.potential, shock, inside);
    }
    lagrange_free(l);
    return 0;
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    for (int f = 0; f < N_FLOWS; f++)
        if (strcmp(name, flows[f].name) == 0 && argc == flows[f].n + 2) return print_flow(&flows[f], argv + 2);
    if (strcmp(name, "sedov-constant") == 0 && argc == 3) return printf("%.10g\n", exact_sedov(atof(argv[2])).constant) < 0;
    if (strcmp(name, "evrard") == 0 && argc == 4) return print_profile(atoi(argv[2]), atof(argv[3]));
    if (strcmp(name, "evrard-energies") == 0 && argc == 5)
        return print_energies(atoi(argv[2]), atof(argv[3]), atof(argv[4]));
    fprintf(stderr, "usage, with coordinates on standard input:\n");
    for (int f = 0; f < N_FLOWS; f++) fprintf(stderr, "  reference %s %s\n", flows[f].name, flows[f].arguments);
    fprintf(stderr, "and without:\n  reference sedov-constant GAMMA\n  reference evrard ZONES TIME\n"
                    "  reference evrard-energies ZONES END EVERY\n");
    return 2;
}
