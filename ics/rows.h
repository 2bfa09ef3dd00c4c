/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the generators have in common: rows of one species with ids and equal masses, their centre. */
#ifndef TEPHRA_ROWS_H
#define TEPHRA_ROWS_H
#include "sim.h"

/* n rows of the species, the only ones of the simulation, with ids from 1 and equal masses that sum
 * to `mass`; positions, velocities and all else are zero. */
struct species *rows_make(struct sim *sim, enum species_kind kind, int64_t n, double mass);
/* Moves equal rows so that their centre of mass and its velocity are zero. */
void rows_centre(struct species *table);
/* Gives every gas row this specific internal energy; nothing to do for other species. */
void rows_set_u(struct species *table, double u);
/* The same from a temperature in K: with this mean molecular weight, or, if it is NAN, with that of the module that
 * knows it (sim->kelvin), else with layout_kelvin. The scene has physical units. */
void rows_set_temperature(struct sim *sim, double kelvin, double mu);
/* The sides of the scene's box; `length` instead of box.x where it is a number. False, and a problem noted in the
 * generator's name, if there is no box that is closed on all sides but such an x. */
bool rows_box(struct sim *sim, const char *generator, double length, double side[3]);
#endif
