/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two equal disc galaxies on a Kepler orbit: the relative orbit lies in the plane z = 0, turns towards +z and has its
 * pericentre on the x axis. A disc is turned about y by its inclination, then about z by its azimuth (the convention of
 * Barnes 1988, ApJ 331, 699; Toomre & Toomre 1972, ApJ 178, 623). */
#include "galaxy.h"
#include <math.h>

struct merger {
    struct galaxy galaxy;
    double pericentre, separation, eccentricity, inclination[2], azimuth[2];
};

#define ORBIT(name, unit, fallback, low, high, field, text) \
    {name, PARAM_REAL, unit, fallback, low, high, NULL, text, false, offsetof(struct merger, field)},

static const struct param params[] = {
    GALAXY_PARAMS(merger)
    ORBIT("pericentre", "length", NULL, 1e-30, 1e30, pericentre, "least distance of two points of the galaxies' masses")
    ORBIT("separation", "length", NULL, 1e-30, 1e30, separation, "distance at the start, on the way in")
    ORBIT("eccentricity", "", "1", 0, 10, eccentricity, "of the orbit; 1 is a parabola")
    ORBIT("inclination_1", "angle", "60 deg", -10, 10, inclination[0], "angle between the first disc's spin and the orbit's")
    ORBIT("azimuth_1", "angle", "-30 deg", -10, 10, azimuth[0], "angle from pericentre to its spin's projection")
    ORBIT("inclination_2", "angle", "60 deg", -10, 10, inclination[1], "the same of the second disc")
    ORBIT("azimuth_2", "angle", "-30 deg", -10, 10, azimuth[1], "the same of the second disc")
    {0}
};

static void turn(double x[3], double inclination, double azimuth)
{
    double across = x[0] * cos(inclination) + x[2] * sin(inclination), up = x[2] * cos(inclination) - x[0] * sin(inclination);
    double y = x[1];
    x[0] = across * cos(azimuth) - y * sin(azimuth);
    x[1] = across * sin(azimuth) + y * cos(azimuth);
    x[2] = up;
}

/* Place and velocity of the second body relative to the first: v^2 = G M (2/r - (1 - e)/r_p), L^2 = G M r_p (1 + e),
 * cos(theta) = (p/r - 1)/e, before pericentre. */
static bool orbit(struct sim *sim, const struct merger *merger, double mass, double x[2], double v[2])
{
    const double r = merger->separation, e = merger->eccentricity, near = merger->pericentre, GM = sim->units.G * mass;
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

static void move(const struct galaxy_rows *rows, const double angle[2], const double pos[2], const double vel[2])
{
    for (int k = 0; k < GALAXY_PARTS; k++) {
        const struct rows *part = &rows->part[k];
        for (int64_t i = part->first; i < part->first + part->n; i++) {
            turn(part->table->pos[i], angle[0], angle[1]);
            turn(part->table->vel[i], angle[0], angle[1]);
            for (int d = 0; d < 2; d++) {
                part->table->pos[i][d] += pos[d];
                part->table->vel[i][d] += vel[d];
            }
        }
    }
}

static void advise(struct sim *sim, const void *state, int64_t n)
{
    (void)n;
    galaxy_advise(sim, &((const struct merger *)state)->galaxy);
}

static void merger_make(struct sim *sim, const void *state, int64_t n)
{
    const struct merger *merger = state;
    const int64_t count[2] = {n - n / 2, n / 2};
    struct galaxy_rows rows[2];
    double x[2], v[2];
    for (int g = 0; g < 2; g++)
        if (!galaxy_add(sim, &merger->galaxy, count[g], g + 1, &rows[g])) return;
    if (!orbit(sim, merger, rows[0].mass + rows[1].mass, x, v)) return;
    for (int g = 0; g < 2; g++) {
        const double side = g ? 0.5 : -0.5, angle[2] = {merger->inclination[g], merger->azimuth[g]};
        move(&rows[g], angle, (double[2]){side * x[0], side * x[1]}, (double[2]){side * v[0], side * v[1]});
    }
}

const struct generator merger_generator = {
    .name = "merger", .doc = "two equal disc galaxies on a Kepler orbit, their discs inclined to it",
    .params = params, .state_bytes = sizeof(struct merger), .advise = advise, .make = merger_make,
};
