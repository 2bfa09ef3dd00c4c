/* SPDX-License-Identifier: GPL-3.0-or-later
 * Units of a scene. `units: {G: 1}` is a dimensionless scene (quantities with units are refused);
 * `units: {length: kpc, mass: 1e10 Msun, velocity: km/s}` a physical one, G following from them. */
#ifndef TEPHRA_UNITS_H
#define TEPHRA_UNITS_H
#include "param.h"
#include <stdbool.h>

struct units {
    bool physical;
    double length, mass, velocity;  /* one code unit in cm, g, cm/s; 1 if not physical */
    double G;                       /* in code units */
};
struct scene;
struct problems;

extern const struct param units_params[];
void units_read(struct units *units, const struct scene *scene, struct problems *problems);
/* The block `units:` for used.yml, its heading included; reading it gives the same bits. */
void units_write(FILE *stream, const struct units *units);
/* Reads "20 K", "3kpc", "1e51 erg", "5 Msun/pc^3", "0.1" as a quantity of the named dimension ("" is
 * a pure number) into code units; temperatures are in K, angles in radians in every scene. Returns
 * NULL, or why not ("expects a length, not a mass (Msun)"): a text to be freed with mem_free. */
char *units_parse(const struct units *units, const char *text, const char *dimension, double *value);
/* Seconds of the clock on the wall: "3h", "90m" (minutes), "1800s", "2d", "1800". Returns as above. */
char *units_parse_wall(const char *text, double *seconds);
/* Code unit of a dimension in cgs (K for temperature). */
double units_cgs(const struct units *units, const char *dimension);
#endif
