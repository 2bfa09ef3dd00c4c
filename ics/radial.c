/* SPDX-License-Identifier: GPL-3.0-or-later
 * Profiles (radial.h). All are written with 4 pi left out of the density until the end. */
#include "radial.h"
#include <gsl/gsl_sf_gamma.h>
#include <math.h>

static const double FOUR_PI = 12.566370614359172954;
/* d of the tail in parts of the cut: between the 0.1 and 0.3 that Kazantzidis et al. (2004, ApJ 601, 37) use. */
static const double tail = 0.2;

/* The model without a cut; rho in units of its coefficient over 4 pi, mass and outer with the coefficient. */
static struct radial_point uncut(const struct radial *p, double r)
{
    const double a = p->radius, s = r + a, q = r * r + a * a, k = p->scale;
    switch (p->form) {
    case RADIAL_HERNQUIST:
        return (struct radial_point){k / (r * s * s * s), -1 / r - 3 / s, 1 / (r * r) + 3 / (s * s),
                                      k / (2 * a) * (r / s) * (r / s), k / 2 / (s * s)};
    case RADIAL_NFW:
        return (struct radial_point){k / (r * s * s), -1 / r - 2 / s, 1 / (r * r) + 2 / (s * s),
                                      k * (log1p(r / a) - r / s), k / s};
    case RADIAL_PLUMMER:
        return (struct radial_point){k / (q * q * sqrt(q)), -5 * r / q, 5 * (r * r - a * a) / (q * q),
                                      k / (3 * a * a) * r * r * r / (q * sqrt(q)), k / 3 / (q * sqrt(q))};
    case RADIAL_DISC:
        return (struct radial_point){k / r * exp(-r / a), -1 / r - 1 / a, 1 / (r * r),
                                      -k * a * a * (expm1(-r / a) + r / a * exp(-r / a)), k * a * exp(-r / a)};
    }
    return (struct radial_point){0};
}

/* Integral over the tail of 4 pi rho r^(2 - n) from r on: an incomplete gamma function. */
static double beyond(const struct radial *p, double r, int n)
{
    const double most = 500, x = r / p->decay, c = p->cut / p->decay;   /* exp(-most) is nothing */
    if (x > most) return 0;
    double order = p->power + 3 - n;
    return p->edge * pow(p->decay, 3 - n) * pow(c, -p->power) * exp(c) * gsl_sf_gamma_inc(order, x);
}

void radial_prepare(struct radial *p)
{
    p->scale = 1;
    bool closed = isnan(p->cut);
    double a = p->radius, whole = p->form == RADIAL_HERNQUIST ? 1 / (2 * a) : p->form == RADIAL_PLUMMER ? 1 / (3 * a * a)
        : p->form == RADIAL_DISC ? a * a : uncut(p, p->cut).mass;
    p->scale = p->mass / whole;
    if (closed) return;
    struct radial_point at = uncut(p, p->cut);
    p->decay = tail * p->cut;
    p->power = at.slope * p->cut + 1 / tail;
    p->edge = at.rho;
    p->inside = at.mass;
    p->around = beyond(p, p->cut, 1);
}

struct radial_point radial_at(const struct radial *p, double r)
{
    struct radial_point at;
    bool cut = !isnan(p->cut);
    if (cut && r > p->cut) {
        at.rho = p->edge * pow(r / p->cut, p->power) * exp((p->cut - r) / p->decay);
        at.slope = p->power / r - 1 / p->decay;
        at.bend = -p->power / (r * r);
        at.mass = p->inside + beyond(p, p->cut, 0) - beyond(p, r, 0);
        at.outer = beyond(p, r, 1);
    } else {
        at = uncut(p, r);
        if (cut) at.outer += p->around - uncut(p, p->cut).outer;
    }
    at.rho /= FOUR_PI;
    return at;
}

double radial_end(const struct radial *p)
{
    const double far = 1e5, last = 8;   /* radii; cuts: there exp(-40) is left */
    return isnan(p->cut) ? far * p->radius : last * p->cut;
}
