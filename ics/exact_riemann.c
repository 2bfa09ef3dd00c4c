/* SPDX-License-Identifier: GPL-3.0-or-later
 * Riemann's problem for an ideal gas (Toro 2009, "Riemann Solvers and Numerical Methods for Fluid Dynamics",
 * chapter 4; equations by number there), written so that gamma = 1, isothermal gas, is a limit of the
 * same formulas and no case of its own. */
#include "exact.h"
#include "fail.h"
#include <math.h>

static double sound_speed(double gamma, struct exact_state s) { return sqrt(gamma * s.p / s.rho); }

/* (e^(z x) - 1) / z and (1 + z x)^(1/z), which for z = 0 are x and e^x. */
static double growth(double z, double x) { return z > 0.0 ? expm1(z * x) / z : x; }
static double power(double z, double x) { return exp(z > 0.0 ? log1p(z * x) / z : x); }

/* Change of velocity across the wave from `s` to pressure p: eqs. 4.6, 4.7 (shock, rarefaction). */
static double change(double gamma, struct exact_state s, double p)
{
    if (p > s.p) return (p - s.p) * sqrt(2.0 / s.rho / ((gamma + 1.0) * p + (gamma - 1.0) * s.p));
    return sound_speed(gamma, s) / gamma * growth((gamma - 1.0) / (2.0 * gamma), log(p / s.p));
}

static double total_change(const struct exact_riemann *r, double p)
{
    return change(r->gamma, r->left, p) + change(r->gamma, r->right, p) + r->right.v - r->left.v;
}

/* The sum of both changes grows with p: its zero lies between bounds that are halved in log p. */
struct exact_riemann exact_riemann(double gamma, struct exact_state left, struct exact_state right)
{
    struct exact_riemann r = {gamma, left, right, 0.0, 0.0};
    double low = 1e-30 * fmin(left.p, right.p), high = fmax(left.p, right.p);
    check(total_change(&r, low) < 0.0);     /* else a vacuum opens */
    while (total_change(&r, high) < 0.0) high *= 4.0;
    for (int k = 0; k < 200; k++) {
        r.p = sqrt(low) * sqrt(high);
        *(total_change(&r, r.p) < 0.0 ? &low : &high) = r.p;
    }
    r.v = 0.5 * (left.v + right.v + change(gamma, right, r.p) - change(gamma, left, r.p));
    return r;
}

/* Left of the contact, eqs. 4.50 to 4.63. */
static struct exact_state left_at(double gamma, struct exact_state s, double p, double v, double xi)
{
    double ratio = p / s.p, g = (gamma - 1.0) / (gamma + 1.0), c = sound_speed(gamma, s);
    if (p > s.p) {
        double shock = s.v - c * sqrt(((gamma + 1.0) * ratio + gamma - 1.0) / (2.0 * gamma));
        return xi < shock ? s : (struct exact_state){s.rho * (ratio + g) / (g * ratio + 1.0), v, p};
    }
    double inner = c * pow(ratio, (gamma - 1.0) / (2.0 * gamma));
    if (xi < s.v - c) return s;
    if (xi > v - inner) return (struct exact_state){s.rho * pow(ratio, 1.0 / gamma), v, p};
    struct exact_state fan = {.v = (2.0 * (c + xi) + (gamma - 1.0) * s.v) / (gamma + 1.0)};
    fan.rho = s.rho * power(0.5 * (gamma - 1.0), (s.v - fan.v) / c);
    fan.p = s.p * pow(fan.rho / s.rho, gamma);
    return fan;
}

struct exact_state exact_riemann_at(const struct exact_riemann *r, double xi)
{
    if (xi <= r->v) return left_at(r->gamma, r->left, r->p, r->v, xi);
    struct exact_state mirror = {r->right.rho, -r->right.v, r->right.p};
    struct exact_state s = left_at(r->gamma, mirror, r->p, -r->v, -xi);
    s.v = -s.v;
    return s;
}
