/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rates and their closed forms (conduction.h): in each regime dm/dt = k m^q. */
#include "conduction.h"
#include "constants.h"
#include <math.h>

static const double critical = 0.03, saturated = 1;
static const double width = 0.3;            /* of the blend to each side, dex */
static const double coldest = 1e5;          /* K: below, nothing evaporates */
static const double to_suns = CONST_YEAR * 1e3 / CONST_M_SUN;   /* kg/s in Msun/yr */

static double radius(const struct conduction *law, double m) { return law->radius * pow(m / 1e6, law->power); }

double conduction_sigma(const struct conduction *law, double T, double n, double m)
{
    return T / 1.54e7 * (T / 1.54e7) / (law->part * n * radius(law, m));
}

/* Mass of the cloud whose sigma_0 is s. */
static double mass_of(const struct conduction *law, double T, double n, double s)
{
    double h = T / 1.54e7 * (T / 1.54e7) / (law->part * n * s);
    return 1e6 * pow(h / law->radius, 1 / law->power);
}

/* The three regimes as k m^q. */
struct regime { double k, q; };

static struct regime condensing(const struct conduction *law, double T, double n)
{
    double h = radius(law, 1);
    return (struct regime){to_suns * 0.825 * sqrt(T) * 1.54e7 * 1.54e7 * law->part * n * h * h, 2 * law->power};
}

static struct regime classical(const struct conduction *law, double T)
{
    return (struct regime){-to_suns * 27.5 * law->part * pow(T, 2.5) * radius(law, 1), law->power};
}

static struct regime saturating(const struct conduction *law, double T, double n)
{
    struct regime r = classical(law, T);
    r.k *= pow(conduction_sigma(law, T, n, 1), -0.625);
    r.q *= 1.625;
    return r;
}

static double rate_of(struct regime r, double m) { return r.k * pow(m, r.q); }

double conduction_rate(const struct conduction *law, double T, double n, double m)
{
    double s = conduction_sigma(law, T, n, m), in = rate_of(condensing(law, T, n), m);
    if (T < coldest) return in;
    double out = rate_of(s > saturated ? saturating(law, T, n) : classical(law, T), m);
    double x = law->sharp ? (s < critical ? -1 : 1) : log10(s / critical) / width;
    double y = fmin(fmax(0.5 * (1 + x), 0), 1), w = y * y * (3 - 2 * y);
    return (1 - w) * in + w * out;
}

/* m after a time: m^(1-q) = m0^(1-q) + (1-q) k t. */
static double advance(struct regime r, double m, double time)
{
    double p = 1 - r.q;
    if (fabs(p) < 1e-9) return m * exp(r.k * time);
    double base = pow(m, p) + p * r.k * time;
    return base > 0 ? pow(base, 1 / p) : 0;
}

static double time_to(struct regime r, double m, double end)
{
    double p = 1 - r.q;
    return fabs(p) < 1e-9 ? log(end / m) / r.k : (pow(end, p) - pow(m, p)) / (p * r.k);
}

/* One step of the classical Runge-Kutta method within the blend. */
static double step(const struct conduction *law, double T, double n, double m, double dt)
{
    double a = conduction_rate(law, T, n, m), b = conduction_rate(law, T, n, m + 0.5 * dt * a);
    double c = conduction_rate(law, T, n, m + 0.5 * dt * b), d = conduction_rate(law, T, n, m + dt * c);
    return m + dt * (a + 2 * b + 2 * c + d) / 6;
}

/* Until the cloud leaves the blend, which it does outwards, or the time is over. */
static double blend(const struct conduction *law, double T, double n, double m, double *left)
{
    const double part = 0.01, low = critical * pow(10, -width), high = critical * pow(10, width);
    while (*left > 0) {
        double s = conduction_sigma(law, T, n, m), dt = fmin(*left, part * m / rate_of(condensing(law, T, n), m));
        if (s <= low || s >= high) break;
        m = step(law, T, n, m, dt);
        *left -= dt;
    }
    return m;
}

double conduction_advance(const struct conduction *law, double T, double n, double m, double time)
{
    double left = time;
    if (T < coldest) return advance(condensing(law, T, n), m, time);
    if (!law->sharp) m = blend(law, T, n, m, &left);
    if (!(left > 0)) return m;
    double s = conduction_sigma(law, T, n, m);
    if (s < critical) return advance(condensing(law, T, n), m, left);
    if (s < saturated) {
        double end = mass_of(law, T, n, saturated), until = time_to(classical(law, T), m, end);
        if (until >= left) return advance(classical(law, T), m, left);
        m = end;
        left -= until;
    }
    return advance(saturating(law, T, n), m, left);
}

/* The zones after the cloud has gained so much. */
static struct conduction_zones moved(const struct conduction_zones *z, double gain)
{
    struct conduction_zones now = *z;
    now.cloud += gain;
    now.gas -= gain;
    now.n *= now.gas / z->gas;
    if (gain < 0) now.T = (z->gas * z->T - gain * z->T_cloud) / now.gas;
    return now;
}

static double sigma_of(const struct conduction *law, const struct conduction_zones *z)
{
    return conduction_sigma(law, z->T, z->n, z->cloud);
}

/* With a jump the gain ends where sigma_0 would cross it: bisection. */
static double stop_at_jump(const struct conduction *law, const struct conduction_zones *z, double gain)
{
    struct conduction_zones end = moved(z, gain);
    if (!law->sharp || end.cloud <= 0 || (sigma_of(law, z) < critical) == (sigma_of(law, &end) < critical)) return gain;
    double low = 0, high = 1;
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        end = moved(z, middle * gain);
        if ((sigma_of(law, z) < critical) == (sigma_of(law, &end) < critical)) low = middle;
        else high = middle;
    }
    return low * gain;
}

/* Where the branches cancel, each of them counts: at a fixed state of the gas the balance is not stable. */
static double fastest(const struct conduction *law, const struct conduction_zones *z)
{
    return fmax(fabs(conduction_rate(law, z->T, z->n, z->cloud)),
                sigma_of(law, z) < saturated ? rate_of(condensing(law, z->T, z->n), z->cloud) : 0);
}

void conduction_zones(const struct conduction *law, struct conduction_zones *zones, double time)
{
    const double part = 0.02, least = 1e-4;     /* of the masses, in one go; smaller clouds vanish in one */
    while (time > 0 && zones->cloud > 0) {
        double rate = fastest(law, zones), dt = time;
        double most = fmin(part * zones->gas, fmax(part * zones->cloud, least * zones->gas));
        if (rate * dt > most) dt = most / rate;
        double half = conduction_advance(law, zones->T, zones->n, zones->cloud, 0.5 * dt) - zones->cloud;
        struct conduction_zones mean = moved(zones, stop_at_jump(law, zones, fmin(half, part * zones->gas)));
        double gain = conduction_advance(law, mean.T, mean.n, zones->cloud, dt) - zones->cloud;
        double given = stop_at_jump(law, zones, fmin(gain, part * zones->gas));
        *zones = moved(zones, given);
        if (given != gain && given == 0) return;
        time -= dt;
    }
    zones->cloud = fmax(zones->cloud, 0);
}
