/* SPDX-License-Identifier: GPL-3.0-or-later
 * Black holes of holes.h. */
#include "holes.h"
#include "log.h"
#include "rows.h"
#include <math.h>

static const double pi = 3.14159265358979323846;

int64_t holes_reserve(struct sim *sim, const struct holes *holes, int64_t n)
{
    const char *missing = isnan(holes->mass) ? "start.hole_mass" : NULL;
    if (!missing && holes->n > 1 && isnan(holes->distance)) missing = "start.hole_distance";
    if ((holes->n < 1 && !isnan(holes->mass)) || (holes->n < 2 && !isnan(holes->distance)))
        log_warning("start.holes = %lld: hole_mass acts from 1 on, hole_distance from 2", (long long)holes->n);
    if (holes->n == 0) return n;
    species_need(&sim->species[STAR], COLUMN_hole);
    if (missing) problems_add(&sim->problems, "%s: give it, since start.holes = %lld", missing, (long long)holes->n);
    else if (holes->n >= n) problems_add(&sim->problems, "start.n = %lld: no rows are left beside %lld black holes", (long long)n,
                                         (long long)holes->n);
    else if (sim_state(sim, "gravity") && !sim_state(sim, "black_holes"))
        problems_add(&sim->problems, "start.holes: black holes need the block black_holes");
    else return n - holes->n;
    return 0;
}

void holes_make(struct sim *sim, const struct holes *holes, double inside)
{
    if (holes->n == 0) return;
    struct rows rows = rows_add(sim, STAR, holes->n, (double)holes->n * holes->mass);
    double others = 0;      /* what the others of the circle pull, as a mass in its centre */
    for (int64_t k = 1; k < holes->n; k++) others += holes->mass / (4 * sin(pi * (double)k / (double)holes->n));
    const double r = holes->n > 1 ? holes->distance : 0;
    const double v = holes->n > 1 ? holes->speed * sqrt(sim->units.G * (inside + others) / r) : 0;
    for (int64_t i = 0; i < holes->n; i++) {
        const double angle = 2 * pi * (double)i / (double)holes->n;
        double *pos = rows.table->pos[rows.first + i], *vel = rows.table->vel[rows.first + i];
        pos[0] = r * cos(angle);
        pos[1] = r * sin(angle);
        vel[0] = -v * sin(angle);
        vel[1] = v * cos(angle);
        rows.table->hole[rows.first + i] = 1;
    }
}
