/* SPDX-License-Identifier: GPL-3.0-or-later
 * Noh's implosion (1987, J. Comput. Phys. 72, 78): a sphere of cold, even gas all of which falls towards its
 * centre with the same speed. A shock runs outwards through it at a third of that speed (gamma = 5/3). */
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "rows.h"
#include <math.h>

struct noh { double rho, radius, speed, u; int places; };
enum { LATTICE, GLASS };

static const struct param params[] = {
    {"density", PARAM_REAL, "density", "1", 1e-300, 1e300, NULL, "density of the sphere", false, offsetof(struct noh, rho)},
    {"radius", PARAM_REAL, "length", "1", 1e-300, 1e300, NULL, "radius of the sphere", false, offsetof(struct noh, radius)},
    {"speed", PARAM_REAL, "velocity", "1", 0, 1e300, NULL, "with which all gas falls", false, offsetof(struct noh, speed)},
    {"u", PARAM_REAL, "specific_energy", "1e-6", 1e-300, 1e300, NULL, "specific internal energy", false,
     offsetof(struct noh, u)},
    {"places", PARAM_CHOICE, "", "lattice", 0, 0, "lattice|glass",
     "of the rows: a lattice is the most even, a glass has no axes", false, offsetof(struct noh, places)},
    {0}
};

static const double PI = 3.14159265358979323846;

static void noh_make(struct sim *sim, const void *state, int64_t n)
{
    const struct noh *noh = state;
    struct species *gas = rows_make(sim, GAS, n, 4.0 / 3 * PI * pow(noh->radius, 3) * noh->rho);
    double (*ball)[3] = noh->places == GLASS ? lattice_glass_ball(n) : lattice_ball(n);
    for (int64_t i = 0; i < n; i++) {
        double r = sqrt(ball[i][0] * ball[i][0] + ball[i][1] * ball[i][1] + ball[i][2] * ball[i][2]);
        for (int k = 0; k < 3; k++) {
            gas->pos[i][k] = noh->radius * ball[i][k];
            gas->vel[i][k] = -noh->speed * ball[i][k] / r;
        }
    }
    mem_free(ball);
    rows_centre(rows_all(gas));
    rows_set_u(gas, noh->u);
}

const struct generator noh_generator = {
    .name = "noh", .doc = "a sphere of cold gas that falls on its centre with one speed (Noh 1987)",
    .params = params, .state_bytes = sizeof(struct noh), .make = noh_make,
};
