/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two equal disc galaxies on a Kepler orbit, their discs inclined to it (orbit.h). */
#include "galaxy.h"
#include "orbit.h"
#include "start.h"

struct merger {
    struct galaxy galaxy;
    struct orbit orbit;
};

static const struct param params[] = {
    GALAXY_PARAMS(merger)
    ORBIT_PARAMS(merger, "disc", "60 deg", "-30 deg")
    {0}
};

static void move(const struct galaxy_rows *rows, const double angle[2], const double pos[2], const double vel[2])
{
    for (int k = 0; k < GALAXY_PIECES; k++) {
        const struct rows *part = &rows->part[k];
        for (int64_t i = part->first; i < part->first + part->n; i++) {
            orbit_turn(part->table->pos[i], angle[0], angle[1]);
            orbit_turn(part->table->vel[i], angle[0], angle[1]);
            for (int d = 0; d < 2; d++) {
                part->table->pos[i][d] += pos[d];
                part->table->vel[i][d] += vel[d];
            }
        }
    }
}

static void advise(struct sim *sim, const void *state, int64_t n)
{
    galaxy_advise(sim, &((const struct merger *)state)->galaxy, n / 2);
    start_advise(sim, "profiles", "split", (double)(n - n / 2));    /* ids of the first galaxy */
}

static void merger_make(struct sim *sim, const void *state, int64_t n)
{
    const struct merger *merger = state;
    const int64_t count[2] = {n - n / 2, n / 2};
    struct galaxy_rows rows[2];
    double x[2], v[2];
    if (merger->galaxy.fixed || merger->galaxy.bulge_fixed) {
        problems_add(&sim->problems, "start.dark_fixed, start.bulge_fixed: galaxies that move have halos and bulges of rows");
        return;
    }
    for (int g = 0; g < 2; g++)
        if (!galaxy_add(sim, &merger->galaxy, count[g], g + 1, &rows[g])) return;
    if (!orbit_place(sim, &merger->orbit, rows[0].mass + rows[1].mass, x, v)) return;
    for (int g = 0; g < 2; g++) {
        const double side = g ? 0.5 : -0.5, angle[2] = {merger->orbit.inclination[g], merger->orbit.azimuth[g]};
        move(&rows[g], angle, (double[2]){side * x[0], side * x[1]}, (double[2]){side * v[0], side * v[1]});
    }
}

const struct generator merger_generator = {
    .name = "merger", .doc = "two equal disc galaxies on a Kepler orbit, their discs inclined to it",
    .params = params, .state_bytes = sizeof(struct merger), .advise = advise, .make = merger_make,
};
