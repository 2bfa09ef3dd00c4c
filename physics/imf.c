/* SPDX-License-Identifier: GPL-3.0-or-later
 * Initial mass functions as power laws that join (imf.h; doc/manual/populations.md, section 1). */
#include "imf.h"
#include <math.h>

/* dN/dm ~ m^-slope from `from` on. */
struct segment { double from, slope; };
enum { SEGMENTS = 3 };

static const struct segment segments[N_IMFS][SEGMENTS] = {
    [IMF_KROUPA_1993] = {{IMF_LOWEST, 1.3}, {0.5, 2.2}, {1, 2.7}},
    [IMF_KROUPA_2001] = {{IMF_LOWEST, 1.3}, {0.5, 2.3}, {IMF_HIGHEST, 2.3}},
    [IMF_SALPETER] = {{IMF_LOWEST, 2.35}, {IMF_HIGHEST, 2.35}, {IMF_HIGHEST, 2.35}},
    [IMF_CHABRIER_2003] = {{1, 2.3}, {IMF_HIGHEST, 2.3}, {IMF_HIGHEST, 2.3}},
};

/* Chabrier 2003, table 1: dN/dlog10 m ~ exp(-(log10 m - log10 0.079)^2 / (2 0.69^2)). */
static const double chabrier_centre = 0.079, chabrier_width = 0.69;

/* dN/dm of the lognormal relative to its value at 1 Msun. */
static double lognormal(double m)
{
    double x = log10(m / chabrier_centre) / chabrier_width, x1 = log10(1 / chabrier_centre) / chabrier_width;
    return exp(0.5 * (x1 * x1 - x * x)) / m;
}

/* int_IMF_LOWEST^1 m lognormal dm: with y = ln m the integrand is m times a Gaussian in y, whose integral is
 * the difference of two error functions about a centre moved by the square of the width. */
static double lognormal_mass(void)
{
    double width = chabrier_width * log(10), centre = log(chabrier_centre), moved = centre + width * width;
    double scale = exp(0.5 * centre * centre / (width * width) + centre + 0.5 * width * width);
    double part = erf((0 - moved) / (width * sqrt(2))) - erf((log(IMF_LOWEST) - moved) / (width * sqrt(2)));
    return scale * width * sqrt(0.5 * acos(-1)) * part;
}

/* The shape: power laws that join, relative to 1 at the start of the first. */
static double shape(enum imf_kind kind, double m)
{
    double factor = 1;
    const struct segment *s = segments[kind];
    if (kind == IMF_CHABRIER_2003 && m < 1) return lognormal(m);
    for (; s + 1 < segments[kind] + SEGMENTS && m >= s[1].from; s++) factor *= pow(s[1].from / s[0].from, -s[0].slope);
    return factor * pow(m / s->from, -s->slope);
}

static double mass(enum imf_kind kind)
{
    double sum = kind == IMF_CHABRIER_2003 ? lognormal_mass() : 0;
    for (int k = 0; k < SEGMENTS; k++) {
        const struct segment *s = &segments[kind][k];
        double end = k + 1 < SEGMENTS ? s[1].from : IMF_HIGHEST, power = 2 - s->slope;
        sum += shape(kind, s->from) * s->from * s->from * (pow(end / s->from, power) - 1) / power;
    }
    return sum;
}

double imf_density(enum imf_kind kind, double m)
{
    return m < IMF_LOWEST || m > IMF_HIGHEST ? 0 : shape(kind, m) / mass(kind);
}
