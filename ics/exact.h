/* SPDX-License-Identifier: GPL-3.0-or-later
 * Flows of gas that are known exactly: what the hydrodynamics is judged by. */
#ifndef TEPHRA_EXACT_H
#define TEPHRA_EXACT_H

struct exact_state { double rho, v, p; };

/* Two uniform states that touch at x = 0 at t = 0. gamma = 1 is isothermal gas, for which p/rho must be the
 * same on both sides. p and v between the waves are found by exact_riemann. */
struct exact_riemann { double gamma; struct exact_state left, right; double p, v; };
struct exact_riemann exact_riemann(double gamma, struct exact_state left, struct exact_state right);
/* The state at x/t = xi. */
struct exact_state exact_riemann_at(const struct exact_riemann *r, double xi);

/* A point explosion of energy E in gas at rest with density rho and no pressure: the shock is at
 * R = constant (E t^2 / rho)^(1/5). */
struct exact_sedov { double gamma, constant; };
struct exact_sedov exact_sedov(double gamma);
/* The state at lambda = r/R, where R = rho = t = 1. */
struct exact_state exact_sedov_at(const struct exact_sedov *s, double lambda);

/* Cold gas of density 1 that falls from all sides on the origin with unit speed, at radius r and time t. */
struct exact_state exact_noh(double gamma, double r, double t);

/* A sound wave that runs towards +x through gas of unit density and sound speed, period 1 in x: at
 * t = 0 v = amplitude sin(2 pi x). Its form steepens; t must be before it breaks, at
 * 1/(pi (gamma + 1) amplitude). */
struct exact_state exact_wave(double gamma, double amplitude, double x, double t);
#endif
