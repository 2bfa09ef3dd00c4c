/* SPDX-License-Identifier: GPL-3.0-or-later
 * Advice of barotrope.h. */
#include "barotrope.h"
#include "mem.h"
#include "start.h"
#include <math.h>
#include <string.h>

double barotrope_said(const struct sim *sim, const char *block, const char *key, const char *dimension)
{
    double value = NAN;
    const char *text = scene_value(sim->scene, block, key);
    char *problem = text ? units_parse(&sim->units, text, dimension, &value) : NULL;
    if (problem) value = NAN;
    mem_free(problem);
    return value;
}

double barotrope_density(const struct sim *sim, double row_mass, double least, double *neighbours)
{
    const double c = barotrope_said(sim, "sph", "sound_speed", "velocity"), four_pi_thirds = 4.18879020478639098;
    *neighbours = barotrope_said(sim, "sph", "neighbours", "");
    if (isnan(*neighbours)) *neighbours = 50;
    const double kernels = 2 * *neighbours * row_mass, length2 = 2.5 * c * c / sim->units.G;
    return isnan(c) ? NAN : fmax(least, length2 * length2 * length2 / (kernels * kernels) / four_pi_thirds);
}

double barotrope_advise(struct sim *sim, double row_mass, double least, double *neighbours)
{
    const char *eos = scene_value(sim->scene, "sph", "eos");
    const double rho = barotrope_density(sim, row_mass, least, neighbours);
    if (isnan(rho) || !eos || strcmp(eos, "barotropic") != 0) return NAN;
    start_advise(sim, "sph", "stiff_density", rho);
    return barotrope_said(sim, "sph", "stiff_density", "density");
}
