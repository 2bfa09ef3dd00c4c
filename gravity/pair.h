/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gravity of a pair: Plummer softening (Aarseth 1963) and the cubic spline of Monaghan & Lattanzio
 * (1985) as GADGET-2 uses it (Springel 2005, eqs. 4 and 71), exact beyond its support h = 2.8 eps.
 *
 * A row brings half of its own softening squared to a pair (of its support squared, for the
 * spline), so that eps_ij^2 = (eps_i^2 + eps_j^2)/2 is the same seen from both sides.
 * Every function returns `pull`, which times PAIR_PULL (source - target) is the acceleration, and
 * `depth`, which times PAIR_DEPTH is minus the potential, both without G: two factors of the Newton
 * step that are cheaper applied to the sums. Arithmetic in `real` (see real.h). */
#ifndef TEPHRA_GRAVITY_PAIR_H
#define TEPHRA_GRAVITY_PAIR_H
#include "real.h"

enum softening_form {
    SOFT_COMMON,    /* Plummer, one softening length above zero for all rows */
    SOFT_PLUMMER,   /* Plummer, any length each, zero too: rows at one place then do not pull */
    SOFT_SPLINE     /* spline, any length each, zero too */
};

struct pair { real pull, depth; };

#define PAIR_PULL  (REAL_GUESS ? 1.5f : 1.f)
#define PAIR_DEPTH (REAL_GUESS ? 0.5f : 1.f)

/* r2 includes the softening. Where y = 1/sqrt(r2) is a guess, one Newton step is folded into its
 * powers: y^3 (5 - 3 r2 y^2)/2 and y (3 - r2 y^2)/2. */
HD struct pair pair_newton(real r2, real mass)
{
    real y = real_rsqrt_guess(r2), y2 = y * y, my = mass * y;
    struct pair p;
    p.pull = my * y2;
    p.depth = my;
    if (REAL_GUESS) {
        p.pull *= real_splat(5.0 / 3.0) - r2 * y2;
        p.depth *= 3.f - r2 * y2;
    }
    return p;
}

/* The same without the Newton step; the sums need no factor. */
HD struct pair pair_guess(real r2, real mass)
{
    real y = real_rsqrt_guess(r2), my = mass * y;
    return (struct pair){ my * (y * y), my };
}

/* Pairs at distance zero contribute nothing where their softening is zero. */
HD struct pair pair_plummer(real r2, real mass, real soft2)
{
    real u2 = r2 + soft2, zero = real_splat(0);
    return pair_newton(real_max(u2, real_splat(REAL_FLOOR)), real_if_less(zero, u2, mass, zero));
}

/* Spline of support^2 = support2. With u = r/h the mass fraction over u^3 and the potential follow
 * from the kernel of Monaghan & Lattanzio (1985) as in Springel (2005), eq. 71; beyond u = 1/2 they
 * are written in s = 1 - u, as one over u less what lies outside, so that nothing cancels. */
HD struct pair pair_spline(real r2, real mass, real support2)
{
    real zero = real_splat(0), half = real_splat(0.5f), one = real_splat(1), floor = real_splat(REAL_FLOOR);
    struct pair p = pair_newton(real_max(r2, floor), real_if_less(zero, r2, mass, zero));
    real d2 = real_max(r2, floor), h2 = real_max(support2, floor);
    real d1 = real_rsqrt_guess(d2), h1 = real_rsqrt_guess(h2);
    d1 *= 1.5f - 0.5f * d2 * d1 * d1;
    h1 *= 1.5f - 0.5f * h2 * h1 * h1;
    real u = r2 * d1 * h1, u2 = u * u;
    real w = real_max(u, half), w1 = one / w, s = one - w, s2 = s * s;
    real third = real_splat(1.0 / 3.0), fifth = real_splat(0.2);
    real inner_pull = 32.f * third + u2 * (-192.f * fifth + 32.f * u);
    real outer_pull = w1 * w1 * w1 * (one - s2 * s2 * (16.f + s * (-128.f * fifth + 32.f * third * s)));
    real inner_depth = 14.f * fifth - u2 * (16.f * third + u2 * (-48.f * fifth + 32.f * fifth * u));
    real outer_depth = w1 * (one - s2 * s2 * s * (16.f * fifth - 32.f * third * fifth * s));
    real near = real_if_less(floor, support2, mass, zero) * h1;
    real pull = near * h1 * h1 * real_if_less(u, half, inner_pull, outer_pull);
    real depth = near * real_if_less(u, half, inner_depth, outer_depth);
    if (REAL_GUESS) {
        pull *= 2.f * third;
        depth *= 1.f / PAIR_DEPTH;
    }
    p.pull = real_if_less(u, one, pull, p.pull);
    p.depth = real_if_less(u, one, depth, p.depth);
    return p;
}

/* The first derivatives of the acceleration that a row at r = source - target feels, by those of r: with y = sqrt(3/(r.r plus
 * the softening)), rv = r.v, second = v.v + r.a and third = 3 v.a + r.j (a, j: accelerations and jerks, source less
 * target), and each derivative from the one before (Nitadori & Makino 2008, New Astronomy 13, 498, in Horner's form):
 *   A = pull r,  J = pull j',  S = pull s',  C = pull c',  where
 *   j' = v - alpha3 r,  s' = a - 2 alpha3 j' - beta3 r,  c' = j - 3 alpha3 s' - 3 beta3 j' - gamma3 r,
 * alpha3, beta3, gamma3 being three times theirs: the root of 3 in y saves the products by 3. The sums of pull r and so on
 * times PAIR_RATES are without it.
 * derivatives: 2 to 4, how many of A, J, S, C are wanted; the factors of the others are not set. */
struct pair_rates { real pull, alpha3, beta3, gamma3; };

#define PAIR_ROOT3 1.7320508075688772
#define PAIR_RATES 0.19245008972987526      /* 3^(-3/2) */

HD struct pair_rates pair_rates(int derivatives, real y, real mass, real rv, real second, real third)
{
    real y2 = y * y;
    struct pair_rates p;
    p.pull = mass * y * y2;
    p.alpha3 = rv * y2;
    if (derivatives > 2) p.beta3 = second * y2 + p.alpha3 * (p.alpha3 * real_splat(1.0 / 3));
    if (derivatives > 3) p.gamma3 = third * y2 + p.alpha3 * (p.beta3 - p.alpha3 * p.alpha3 * real_splat(4.0 / 9));
    return p;
}

HD struct pair pair_any(enum softening_form form, real r2, real mass, real soft2)
{
    return form == SOFT_COMMON ? pair_newton(r2 + soft2, mass)
         : form == SOFT_PLUMMER ? pair_plummer(r2, mass, soft2) : pair_spline(r2, mass, soft2);
}
#endif
