/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `jeans`: says up to which density the rows resolve the Jeans mass, and how much gas is beyond it at every
 * snapshot (Bate & Burkert 1997, MNRAS 288, 1060: two kernels full of rows at most). */
#include "comm.h"
#include "log.h"
#include "module.h"
#include "output.h"
#include "ranks.h"
#include "sph/sph.h"
#include <math.h>

struct jeans { double kernels; };

static const struct param params[] = {
    {"kernels", PARAM_REAL, "", "2", 0.1, 100, NULL, "a Jeans mass is resolved by this many times sph.neighbours rows", true,
     offsetof(struct jeans, kernels)},
    {0}
};
static const char *const needed[] = {"sph", "gravity", NULL};

static const double FOUR_PI_THIRDS = 4.18879020478639098;

static double jeans_mass(double G, double heat, double rho)
{
    double length2 = 2.5 * heat / G;
    return length2 * sqrt(length2) / sqrt(FOUR_PI_THIRDS * rho);
}

/* What the mean row resolves, where the gas has one temperature. */
static void state_resolution(struct sim *sim, void *state)
{
    const struct jeans *jeans = state;
    const struct sph *sph = sim_state(sim, "sph");
    const struct species *gas = &sim->species[GAS];
    if (sph->eos == SPH_ADIABATIC || gas->n == 0) return;
    double sum[2] = {0, 0};
    for (int64_t i = species_from(gas); i < species_to(gas); i++) sum[0] += gas->mass[i];
    ranks_sum(sim, sum, 1);
    double mass = jeans->kernels * (double)sph->neighbours * sum[0] / (double)gas->n;
    double one = jeans_mass(sim->units.G, sph->sound_speed * sph->sound_speed, 1);
    log_line("jeans: masses from %.4g on are resolved, the isothermal Jeans mass up to the density %.4g", mass,
             (one / mass) * (one / mass));
    if (sph->eos == SPH_BAROTROPIC)     /* the least Jeans mass is that at stiff_density, where P/rho is 2 c^2 */
        log_line("jeans: the least Jeans mass is %.4g, at sph.stiff_density = %.4g: %s",
                 sqrt(8) * one / sqrt(sph->stiff_density), sph->stiff_density,
                 sqrt(8) * one / sqrt(sph->stiff_density) < mass ? "NOT resolved" : "resolved");
}

static void record(struct sim *sim, void *state)
{
    const struct jeans *jeans = state;
    const struct sph *sph = sim_state(sim, "sph");
    const struct species *gas = &sim->species[GAS];
    if (!output_wrote_snapshot(sim)) return;
    double sum[2] = {0, 0}, most = 0;
    for (int64_t i = gas->own; i < gas->own + gas->n_own; i++) {
        double rho = (double)gas->rho[i], u = gas->u ? (double)gas->u[i] : 0;
        double kernels = jeans->kernels * (double)sph->neighbours * gas->mass[i];
        bool resolved = kernels <= jeans_mass(sim->units.G, sph_heat(sph, u, rho), rho);
        sum[0] += gas->mass[i];
        sum[1] += resolved ? 0 : gas->mass[i];
        most = fmax(most, rho);
    }
    comm_sum(sum, 2);
    comm_max(&most, 1);
    log_line("jeans: t = %g: %.3g %% of the gas has a Jeans mass that is not resolved; highest density %.4g",
             timeline_now(&sim->time), sum[0] > 0 ? 100 * sum[1] / sum[0] : 0, most);
}

const struct module jeans_module = {
    .name = "jeans", .doc = "how much of the gas resolves its Jeans mass", .params = params, .requires = needed,
    .state_bytes = sizeof(struct jeans), .warn = state_resolution, .hook = {[HOOK_RECORD] = record},
};
