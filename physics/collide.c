/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pairs of clouds (collide.h). */
#include "collide.h"
#include "sph/kernel.h"
#include <math.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Slower approaches than this part of the relative speed are rounding. */
static const double least_approach = 1e-12;

static bool approach(const double r[3], const double v[3])
{
    return dot(r, v) < -least_approach * sqrt(dot(r, r) * dot(v, v));
}

bool collide_contact(const double r[3], const double v[3], double reach, double from, double *time)
{
    double at[3];
    for (int k = 0; k < 3; k++) at[k] = r[k] + from * v[k];
    double b = dot(at, v), c = dot(at, at) - reach * reach, v2 = dot(v, v);
    if (!approach(at, v)) return false;
    *time = from;
    if (c <= 0) return true;
    double root = b * b - v2 * c;
    if (!(root > 0)) return false;
    *time = from + c / (sqrt(root) - b);        /* the earlier root, without cancellation */
    return *time <= 0;
}

/* The velocities of a pair change by an impulse on the line n at `time`: positions now are those on the new paths. */
static void push(struct body *a, struct body *b, const double n[3], double impulse, double time)
{
    for (int k = 0; k < 3; k++) {
        double da = -impulse * n[k] / a->mass, db = impulse * n[k] / b->mass;
        a->vel[k] += da;
        b->vel[k] += db;
        a->pos[k] -= time * da;
        b->pos[k] -= time * db;
    }
}

/* Unit vector from a to b at `time`, and their relative velocity. Returns the distance. */
static double line_of(const struct body *a, const struct body *b, const double shift[3], double time, double n[3], double v[3])
{
    double r = 0;
    for (int k = 0; k < 3; k++) {
        v[k] = b->vel[k] - a->vel[k];
        n[k] = b->pos[k] - a->pos[k] + shift[k] + time * v[k];
    }
    r = sqrt(dot(n, n));
    for (int k = 0; k < 3 && r > 0; k++) n[k] /= r;
    return r;
}

bool collide_bounce(struct body *a, struct body *b, const double shift[3], double restitution, double time, double *lost)
{
    double n[3], v[3], mu = a->mass * b->mass / (a->mass + b->mass);
    line_of(a, b, shift, time, n, v);
    for (int k = 0; k < 3; k++) v[k] += time * (b->acc[k] - a->acc[k]);
    double along = dot(n, v);
    if (!(along < 0)) return false;
    push(a, b, n, -(1 + restitution) * mu * along, time);
    *lost += 0.5 * mu * (1 - restitution * restitution) * along * along;
    return true;
}

double collide_merge(struct body *a, const struct body *b, const double shift[3], double spin[3])
{
    const double whole = a->mass + b->mass, part = b->mass / whole, mu = a->mass * part;
    double r[3], v[3];
    for (int k = 0; k < 3; k++) {
        r[k] = b->pos[k] - a->pos[k] + shift[k];
        v[k] = b->vel[k] - a->vel[k];
    }
    for (int k = 0; k < 3; k++) {
        int p = (k + 1) % 3, q = (k + 2) % 3;
        spin[k] += mu * (r[p] * v[q] - r[q] * v[p]);
        a->pos[k] += part * r[k];
        a->vel[k] += part * v[k];
        a->acc[k] += part * (b->acc[k] - a->acc[k]);
    }
    a->mass = whole;
    return 0.5 * mu * dot(v, v);
}

bool collide_bound(double G, const struct body *a, const struct body *b)
{
    double v2 = 0;
    for (int k = 0; k < 3; k++) v2 += (b->vel[k] - a->vel[k]) * (b->vel[k] - a->vel[k]);
    return 0.5 * v2 < G * (a->mass + b->mass) / (a->radius + b->radius);
}

/* Densities are those of even spheres; W_ij has its support at the sum of the radii. */
double collide_rub(struct body *a, struct body *b, const double shift[3], const struct viscosity *viscosity, double dt)
{
    const double h = 0.5 * (a->radius + b->radius), whole = a->mass + b->mass, mu = a->mass * b->mass / whole;
    const double volume = 4 * acos(-1) / 3;
    double n[3], v[3], r = line_of(a, b, shift, 0, n, v), w = -dot(n, v);
    if (!(r > 0 && r < 2 * h && w > 0)) return 0;
    double density = 0.5 * (a->mass / pow(a->radius, 3) + b->mass / pow(b->radius, 3)) / volume;
    double slope = -(double)sph_kernel_slope((float)(r / h), SPH_CUBIC) / (h * h * h * h);
    double g = h * r / (r * r + 0.01 * h * h), strength = whole * slope / density;
    double linear = strength * viscosity->alpha * viscosity->sound * g, square = strength * viscosity->beta * g * g;
    double left = exp(-linear * dt), gone = linear > 0 ? (1 - left) / linear : dt;
    double now = w * left / (1 + square * w * gone);
    push(a, b, n, mu * (w - now), 0);
    return 0.5 * mu * (w * w - now * now);
}
