/* SPDX-License-Identifier: GPL-3.0-or-later
 * A reference that has nothing in common with the program it judges: gas in spherical shells that move with
 * it, with self-gravity, so that a collapse is known as a function of one coordinate. */
#ifndef TEPHRA_LAGRANGE_1D_H
#define TEPHRA_LAGRANGE_1D_H

/* n zones between n + 1 nodes. Radius and velocity belong to nodes; mass, density, specific internal
 * energy, pressure to zones. */
struct lagrange {
    int n;
    double gamma, G, time, courant;
    double quadratic, linear;       /* viscosity: q2 and q1 */
    long steps;
    double *r, *v, *node_mass, *inside; /* nodes; inside: mass within */
    double *mass, *rho, *u, *p;         /* zones; p holds the viscosity too while a step is made */
    double *r_new, *v_new, *u_new, *rho_new;
};

struct lagrange_energies { double kinetic, thermal, potential; };

/* Evrard's sphere (1988): rho = 1/(2 pi r) within r = 1, u = 0.05, at rest, G = 1, gamma = 5/3, in zones of
 * equal width. */
struct lagrange *lagrange_evrard(int zones);
void lagrange_free(struct lagrange *l);
/* One step that ends at `end` at the latest. */
void lagrange_step(struct lagrange *l, double end);
void lagrange_advance(struct lagrange *l, double end);
struct lagrange_energies lagrange_energies(const struct lagrange *l);
/* The zone that is compressed most: radius of the shock, and mass within. */
double lagrange_shock(const struct lagrange *l, double *inside);
#endif
