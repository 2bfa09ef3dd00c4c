/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two bodies on a Kepler orbit: the relative orbit lies in the plane z = 0, turns towards +z and has its pericentre on the x
 * axis. What lies in the plane z = 0 of a body is turned about y by its inclination, then about z by its azimuth (the
 * convention of Barnes 1988, ApJ 331, 699; Toomre & Toomre 1972, ApJ 178, 623). */
#ifndef TEPHRA_ORBIT_H
#define TEPHRA_ORBIT_H
#include "module.h"

struct orbit { double pericentre, separation, eccentricity, inclination[2], azimuth[2]; };

#define ORBITKEY(owner, name, unit, fallback, low, high, field, text) \
    {name, PARAM_REAL, unit, fallback, low, high, NULL, text, false, offsetof(struct owner, orbit.field)},
/* The rows of the parameter table of `struct OWNER`, which holds a struct orbit named orbit; angles of what is `turned`. */
#define ORBIT_PARAMS(owner, turned, inclined, at) \
    ORBITKEY(owner, "pericentre", "length", NULL, 1e-30, 1e30, pericentre, "least distance of two points of their masses") \
    ORBITKEY(owner, "separation", "length", NULL, 1e-30, 1e30, separation, "distance at the start, on the way in") \
    ORBITKEY(owner, "eccentricity", "", "1", 0, 10, eccentricity, "of the orbit; 1 is a parabola") \
    ORBITKEY(owner, "inclination_1", "angle", inclined, -10, 10, inclination[0], "angle between the spin of the first " turned " and the orbit's") \
    ORBITKEY(owner, "azimuth_1", "angle", at, -10, 10, azimuth[0], "angle from pericentre to its spin's projection") \
    ORBITKEY(owner, "inclination_2", "angle", inclined, -10, 10, inclination[1], "the same of the second " turned) \
    ORBITKEY(owner, "azimuth_2", "angle", at, -10, 10, azimuth[1], "the same of the second " turned)

/* A vector of a body, in place. Angles in radians. */
void orbit_turn(double x[3], double inclination, double azimuth);
/* Place and velocity of the second body relative to the first, for the mass of both; false and a problem if the orbit never
 * has that separation. */
bool orbit_place(struct sim *sim, const struct orbit *orbit, double mass, double x[2], double v[2]);
#endif
