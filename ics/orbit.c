/* SPDX-License-Identifier: GPL-3.0-or-later
 * Kepler orbits of two bodies and turns of what is in them (orbit.h). */
#include "orbit.h"
#include <math.h>

void orbit_turn(double x[3], double inclination, double azimuth)
{
    double across = x[0] * cos(inclination) + x[2] * sin(inclination), up = x[2] * cos(inclination) - x[0] * sin(inclination);
    double y = x[1];
    x[0] = across * cos(azimuth) - y * sin(azimuth);
    x[1] = across * sin(azimuth) + y * cos(azimuth);
    x[2] = up;
}

/* v^2 = G M (2/r - (1 - e)/r_p), L^2 = G M r_p (1 + e),
 * cos(theta) = (p/r - 1)/e, before pericentre. */
bool orbit_place(struct sim *sim, const struct orbit *orbit, double mass, double x[2], double v[2])
{
    const double r = orbit->separation, e = orbit->eccentricity, near = orbit->pericentre, GM = sim->units.G * mass;
    const double p = near * (1 + e), far = e < 1 ? p / (1 - e) : INFINITY;
    if (r < near || r > far * (1 + 1e-12)) {
        problems_add(&sim->problems, "start.separation = %g: this orbit has distances from %g to %g", r, near, far);
        return false;
    }
    double cosine = e > 0 ? fmax(-1, fmin(1, (p / r - 1) / e)) : 1, sine = -sqrt(1 - cosine * cosine);
    double along = sqrt(GM * p) / r, in = sqrt(GM / p) * e * sine;
    x[0] = r * cosine;
    x[1] = r * sine;
    v[0] = in * cosine - along * sine;
    v[1] = in * sine + along * cosine;
    return true;
}
