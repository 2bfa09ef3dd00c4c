/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the generators have in common: rows of one species with ids and equal masses, their centre. */
#ifndef TEPHRA_ROWS_H
#define TEPHRA_ROWS_H
#include "sim.h"

/* Some rows of a table: those that one part of a model is made of. */
struct rows { struct species *table; int64_t first, n; };

/* n rows more, with the ids that follow those of all rows there are, from 1 on, and equal masses that sum to
 * `mass`; positions, velocities and all else are zero. */
struct rows rows_add(struct sim *sim, enum species_kind kind, int64_t n, double mass);
/* The same where they are the only ones of their species. */
struct species *rows_make(struct sim *sim, enum species_kind kind, int64_t n, double mass);
/* All rows of a table. */
struct rows rows_all(struct species *table);
/* Moves equal rows so that their centre of mass and its velocity are zero. */
void rows_centre(struct rows rows);
/* Takes the mean velocity away, and leaves the places where they are: where a few far rows decide where the centre of
 * mass is, a shift would move the dense middle off the origin. */
void rows_rest(struct rows rows);
/* Parts of n in proportion to the shares, whole numbers that sum to n. */
void rows_share(int64_t n, int parts, const double *share, int64_t *count);
/* Masses from least to most whose number in an interval is ~ mass^slope: that below which the part x of them lies. */
struct rows_spectrum { double least, most, slope; };
double rows_mass(const struct rows_spectrum *spectrum, double x);
/* Gives every gas row this specific internal energy; nothing to do for other species. */
void rows_set_u(struct species *table, double u);
/* The same from a temperature in K, with layout_kelvin, or as the module has it that knows better (sim->kelvin). The
 * scene has physical units. */
void rows_set_temperature(struct sim *sim, double kelvin);
/* The sides of the scene's box; `length` instead of box.x where it is a number. False, and a problem noted in the
 * generator's name, if there is no box that is closed on all sides but such an x. */
bool rows_box(struct sim *sim, const char *generator, double length, double side[3]);
#endif
