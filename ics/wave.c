/* SPDX-License-Identifier: GPL-3.0-or-later
 * A sound wave that runs towards +x, one period in the box: Riemann's simple wave (Landau & Lifshitz, "Fluid
 * Mechanics", section 101), exact at any amplitude until it breaks. */
#include "lattice.h"
#include "mem.h"
#include "module.h"
#include "rows.h"
#include <math.h>

struct wave { double rho, c, amplitude; };

static const struct param params[] = {
    {"density", PARAM_REAL, "density", "1", 1e-300, 1e300, NULL, "density of the gas at rest", false,
     offsetof(struct wave, rho)},
    {"sound_speed", PARAM_REAL, "velocity", "1", 1e-300, 1e300, NULL, "sound speed of the gas at rest", false,
     offsetof(struct wave, c)},
    {"amplitude", PARAM_REAL, "", "1e-3", 1e-12, 0.5, NULL, "largest velocity over the sound speed", false,
     offsetof(struct wave, amplitude)},
    {0}
};

static const double PI = 3.14159265358979323846;

struct state { double rho, v, c; };

static struct state wave_at(const struct wave *wave, double gamma, double phase)
{
    double v = wave->amplitude * sin(2 * PI * phase), c = 1 + 0.5 * (gamma - 1) * v;
    return (struct state){wave->rho * pow(c, 2 / (gamma - 1)), wave->c * v, wave->c * c};
}

/* Mass between 0 and each of `cells` + 1 places of a period of unit length, by Simpson's rule. */
enum { CELLS = 1 << 14 };
static double *masses(const struct wave *wave, double gamma)
{
    double *mass = mem_array("generator", double, CELLS + 1);
    for (int k = 0; k < CELLS; k++) {
        double sum = 0;
        for (int p = 0; p < 3; p++) sum += (p == 1 ? 4 : 1) * wave_at(wave, gamma, (k + 0.5 * p) / CELLS).rho;
        mass[k + 1] = mass[k] + sum / (6.0 * CELLS);
    }
    return mass;
}

/* Where a part of the mass lies: the cell by halving, then as if its density were even. */
static double place(const double *mass, double part)
{
    int low = 0, high = CELLS;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (mass[middle] <= part * mass[CELLS]) low = middle;
        else high = middle;
    }
    return (low + (part * mass[CELLS] - mass[low]) / (mass[low + 1] - mass[low])) / CELLS;
}

static void wave_make(struct sim *sim, const void *state, int64_t n)
{
    const struct wave *wave = state;
    const double gamma = sim_real(sim, "gamma", 5.0 / 3);
    double side[3];
    if (!rows_box(sim, "wave", NAN, side)) return;
    double *mass = masses(wave, gamma);
    struct species *gas = rows_make(sim, GAS, n, mass[CELLS] * side[0] * side[1] * side[2]);
    lattice_box(n, side, gas->pos);
    for (int64_t i = 0; i < n; i++) {
        double phase = place(mass, gas->pos[i][0] / side[0]);
        struct state at = wave_at(wave, gamma, phase);
        gas->pos[i][0] = side[0] * phase;
        gas->vel[i][0] = at.v;
        if (gas->u) gas->u[i] = (float)(at.c * at.c / (gamma * (gamma - 1)));
    }
    mem_free(mass);
}

const struct generator wave_generator = {
    .name = "wave", .doc = "a sound wave that runs along x through a box",
    .params = params, .state_bytes = sizeof(struct wave), .make = wave_make,
};
