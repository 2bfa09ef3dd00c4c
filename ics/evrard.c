/* SPDX-License-Identifier: GPL-3.0-or-later
 * Evrard's (1988, MNRAS 235, 911) cold gas sphere: rho = M / (2 pi R^2 r) within R, at rest, with
 * u = 0.05 G M / R. The n innermost points of a face-centred cubic lattice, a ball of even density,
 * are stretched by r -> R (r / r_ball)^(3/2), which makes M(r) = M (r/R)^2 with little noise. */
#include "mem.h"
#include "module.h"
#include "rows.h"
#include "sort.h"
#include <math.h>
#include <string.h>

struct evrard { double mass, radius, u; };

static const struct param params[] = {
    {"mass", PARAM_REAL, "mass", "1", 1e-30, 1e30, NULL, "mass of the sphere", false, offsetof(struct evrard, mass)},
    {"radius", PARAM_REAL, "length", "1", 1e-30, 1e30, NULL, "radius of the sphere", false,
     offsetof(struct evrard, radius)},
    {"u", PARAM_REAL, "specific_energy", "none", 0, 1e30, NULL,
     "specific internal energy; default: 0.05 G mass / radius", false, offsetof(struct evrard, u)},
    {0}
};

static const double PI = 3.14159265358979323846;

/* The lattice: whole (x, y, z) with an even sum, one point to two units of volume. Its centre is put
 * where no two points are equally far from it. */
static const double lattice_volume = 2.0;
static const double lattice_centre[3] = {0.4142135623730950, 0.7320508075688773, 0.2360679774997897};

struct points { double (*pos)[3]; int64_t n; };

/* The lattice points within `radius` of the centre, in the lattice's order; a first walk counts them. */
static struct points ball(double radius)
{
    struct points points = {NULL, 0};
    const int64_t reach = (int64_t)ceil(radius) + 1;
    for (int pass = 0; pass < 2; pass++) {
        int64_t n = 0;
        for (int64_t x = -reach; x <= reach; x++)
            for (int64_t y = -reach; y <= reach; y++) {
                double dx = (double)x - lattice_centre[0], dy = (double)y - lattice_centre[1];
                double left = radius * radius - dx * dx - dy * dy;
                if (left < 0.0) continue;
                int64_t low = (int64_t)ceil(lattice_centre[2] - sqrt(left));
                low += (x + y + low) & 1;
                for (int64_t z = low; (double)z - lattice_centre[2] <= sqrt(left); z += 2, n++) {
                    if (pass == 0) continue;
                    points.pos[n][0] = dx;
                    points.pos[n][1] = dy;
                    points.pos[n][2] = (double)z - lattice_centre[2];
                }
            }
        if (pass == 0) points.pos = mem_alloc("generator", (size_t)n * sizeof *points.pos);
        points.n = n;
    }
    return points;
}

static double square(const double x[3]) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; }

/* Keeps the n points that are nearest to the centre, in their order. */
static void keep_innermost(struct points *points, int64_t n)
{
    uint64_t *key = mem_array("generator", uint64_t, points->n);
    int32_t *row = mem_array("generator", int32_t, points->n);
    for (int64_t i = 0; i < points->n; i++) {
        double r2 = square(points->pos[i]);
        memcpy(&key[i], &r2, sizeof r2);    /* positive doubles are ordered as their bits are */
        row[i] = (int32_t)i;
    }
    sort_keys(key, row, points->n);
    bool *inside = mem_array("generator", bool, points->n);
    for (int64_t i = 0; i < n; i++) inside[row[i]] = true;
    int64_t kept = 0;
    for (int64_t i = 0; i < points->n; i++)
        if (inside[i]) memmove(points->pos[kept++], points->pos[i], sizeof *points->pos);
    points->n = kept;
    mem_free(key);
    mem_free(row);
    mem_free(inside);
}

static void evrard_make(struct sim *sim, const void *state, int64_t n)
{
    const struct evrard *evrard = state;
    struct species *gas = rows_make(sim, GAS, n, evrard->mass);
    double ball_radius = cbrt(3.0 * lattice_volume * (double)n / (4.0 * PI));
    struct points points = ball(ball_radius + 2.0);
    check(points.n >= n);
    keep_innermost(&points, n);
    for (int64_t i = 0; i < n; i++) {
        double stretch = evrard->radius / ball_radius * sqrt(sqrt(square(points.pos[i])) / ball_radius);
        for (int k = 0; k < 3; k++) gas->pos[i][k] = stretch * points.pos[i][k];
    }
    mem_free(points.pos);
    rows_centre(gas);
    rows_set_u(gas, isnan(evrard->u) ? 0.05 * sim->units.G * evrard->mass / evrard->radius : evrard->u);
}

const struct generator evrard_generator = {
    .name = "evrard", .doc = "cold gas sphere with rho ~ 1/r at rest, which collapses and bounces (Evrard 1988)",
    .params = params, .state_bytes = sizeof(struct evrard), .make = evrard_make,
};
