/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pictures of a run: two maps side by side, of logarithmic colour. Gas: column density and
 * temperature (specific internal energy in dimensionless scenes), or, if it is isothermal, the column
 * density along z and along y; without gas the surface densities of two species, or of one species
 * seen along z and along y. */
#ifndef TEPHRA_PICTURE_H
#define TEPHRA_PICTURE_H
#include "sim.h"

/* What stays the same from picture to picture: the first one sets the frame, so that it holds 98 %
 * of the mass, or a closed box; the colour ranges, in decades, only grow. Zeroed at first; plain data for checkpoints. */
struct picture {
    bool set;
    double centre[3], half;
    struct { double low, high; } range[2];
};

/* Writes a PNG, at a full synchronisation. All ranks call it; each adds its own rows where these are spread, the first one
 * writes. */
void picture_write(const struct sim *sim, const char *path, struct picture *picture);
#endif
