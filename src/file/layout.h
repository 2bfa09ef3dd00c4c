/* SPDX-License-Identifier: GPL-3.0-or-later
 * What snapshots have in common: which PartType group holds a species, and the units of the file.
 * Scenes with physical units are always written in kpc, 1e10 Msun and km/s, because yt assumes
 * these; dimensionless scenes as they are. See doc/manual/output.md. */
#ifndef TEPHRA_LAYOUT_H
#define TEPHRA_LAYOUT_H
#include "sim.h"

enum { LAYOUT_TYPES = 6, LAYOUT_HOLES = 5 };    /* PartType0 to PartType5; black holes and sinks, which are star rows here */
extern const int layout_type[N_SPECIES];    /* the PartType of a species' other rows */
/* The PartType of a row. */
int layout_type_of(const struct species *table, int64_t row);
/* Whether the rows of a PartType have a column of their table: marks of holes and sinks, and the spin of these, are theirs. */
bool layout_holds(int type, enum column column);

/* Unit of the file in cgs; 1 for dimensionless scenes. */
struct layout_unit { double length, mass, velocity; const char *name; };
struct layout_unit layout_unit(bool physical);
/* Powers of length, mass and velocity in a column's unit: "M L^-3" gives {-3, 1, 0}. */
void layout_powers(const char *unit, int power[3]);
/* length^power[0] mass^power[1] velocity^power[2] in cgs. */
double layout_cgs(const struct layout_unit *unit, const int power[3]);
/* What a number in code units is multiplied by to be one in the file's. */
double layout_factor(const struct units *code, const char *unit);
/* Multiplies floats (f) or doubles (d); other kinds stay. */
void layout_scale(char kind, void *values, int64_t count, double factor);
/* "1e10 Msun kpc^-3" for "M L^-3"; of a dimensionless scene the unit itself. */
void layout_unit_text(bool physical, const char *unit, char *text, size_t size);
/* Temperature in K of one code unit of specific internal energy, as the module of the gas has it; 0 if the
 * scene is dimensionless or has no such module. */
double layout_kelvin(const struct sim *sim);
/* Temperature in K of every gas row from species_from on. False if the scene is dimensionless or none does. */
bool layout_temperatures(const struct sim *sim, float *kelvin);
/* Gyr for physical scenes; for dimensionless ones the time itself. */
double layout_gyr(const struct units *code, double time);
#endif
