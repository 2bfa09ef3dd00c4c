/* SPDX-License-Identifier: GPL-3.0-or-later
 * Files of cosmological runs, whose numbers carry powers of the scale factor a and of h: what makes them physical. */
#ifndef TEPHRA_START_COSMOLOGY_H
#define TEPHRA_START_COSMOLOGY_H
#include "h5.h"
#include "sim.h"

/* on: the scene asks for physical numbers (start.strip_h); else a = h = 1. */
struct start_cosmology { bool on, comoving, swift; double a, h; };

/* An attribute of whichever group of a header has it. */
bool start_header_number(struct h5 *file, const char *name, double *value);
/* Reads a and h. Where start.strip_h is off, files that need them become problems that name it. */
struct start_cosmology start_cosmology_read(struct sim *sim, struct h5 *file, const char *path);
/* What a number of this data set (NULL: of the header) and unit (columns.h) is multiplied by to be physical. */
double start_cosmology_factor(const struct start_cosmology *c, struct h5 *file, const char *data_set, const char *unit);
#endif
