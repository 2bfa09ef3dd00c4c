/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cold clouds that fill a box evenly, with normal velocities: what their collisions are tested on. Each row is made from its
 * id alone, but for the mean velocity, which is zero. */
#include "lattice.h"
#include "module.h"
#include "random.h"
#include "rows.h"
#include <math.h>

struct cloud_box { double least, most, slope, dispersion; int places; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1e4 Msun", 1e-300, 1e300, NULL, "mass of the lightest cloud", false,
     offsetof(struct cloud_box, least)},
    {"mass_most", PARAM_REAL, "mass", "none", 1e-300, 1e300, NULL, "mass of the heaviest one; default: all have the same", false,
     offsetof(struct cloud_box, most)},
    {"slope", PARAM_REAL, "", "-1.5", -10, 10, NULL, "the number of clouds in an interval of mass is ~ mass^slope", false,
     offsetof(struct cloud_box, slope)},
    {"dispersion", PARAM_REAL, "velocity", "7 km/s", 0, 1e300, NULL, "of the velocities along each axis", false,
     offsetof(struct cloud_box, dispersion)},
    {"places", PARAM_CHOICE, "", "random", 0, 0, "random|lattice", "where the clouds are", false,
     offsetof(struct cloud_box, places)},
    {0}
};

static void cloud_box_make(struct sim *sim, const void *state, int64_t n)
{
    const struct cloud_box *box = state;
    double side[3];
    if (!rows_box(sim, "cloud_box", NAN, side)) return;
    const struct rows_spectrum spectrum = {box->least, isnan(box->most) ? box->least : box->most, box->slope};
    const uint64_t stream = random_stream("cloud_box");
    struct species *cloud = rows_make(sim, CLOUD, n, 1);
    if (box->places == 1) lattice_box(n, side, cloud->pos);
    for (int64_t i = 0; i < n; i++) {
        const struct random key = {sim->seed, cloud->id[i], 0, stream};
        cloud->mass[i] = rows_mass(&spectrum, random_uniform(&key, 3));
        for (int k = 0; k < 3; k++) {
            if (box->places == 0) cloud->pos[i][k] = side[k] * random_uniform(&key, (uint64_t)k);
            cloud->vel[i][k] = box->dispersion * random_normal(&key, 2 + (uint64_t)k);
        }
    }
    double mass = 0, mean[3] = {0};
    for (int64_t i = 0; i < n; i++) mass += cloud->mass[i];
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) mean[k] += cloud->mass[i] * cloud->vel[i][k] / mass;
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) cloud->vel[i][k] -= mean[k];
}

const struct generator cloud_box_generator = {
    .name = "cloud_box", .doc = "cold clouds that fill a box, with random velocities",
    .params = params, .state_bytes = sizeof(struct cloud_box), .make = cloud_box_make,
};
