/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `sph`: parameters, columns, energy and warnings of smoothed particle hydrodynamics
 * (Monaghan 1992, with the neighbours, viscosity and steps of Berczik 1999). */
#include "comm.h"
#include "constants.h"
#include "energy.h"
#include "isa.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include "sph.h"
#include "steps.h"
#include <math.h>

static const struct param params[] = {
    {"neighbours", PARAM_COUNT, "", "50", 4, 1000, NULL, "neighbours within 2h, the row itself not counted", false,
     offsetof(struct sph, neighbours)},
    {"kernel", PARAM_CHOICE, "", "cubic", 0, 0, "cubic|wendland_c2|wendland_c4",
     "cubic spline, or Wendland's, which stay even with many neighbours", false, offsetof(struct sph, kernel)},
    {"count", PARAM_CHOICE, "", "exact", 0, 0, "exact|smooth",
     "exact: 2h is the distance of the last neighbour; smooth: h from the density, neighbours on average", false,
     offsetof(struct sph, count)},
    {"h_min", PARAM_REAL, "length", "0", 0, 1e300, NULL, "smallest smoothing length", false,
     offsetof(struct sph, h_min)},
    {"grad_h", PARAM_FLAG, "", "off", 0, 0, NULL,
     "each row's own h in the equations and the terms of grad h; off: the mean h of a pair", false,
     offsetof(struct sph, grad_h)},
    {"equation", PARAM_CHOICE, "", "energy", 0, 0, "energy|entropy",
     "what is integrated: u, or, with grad_h, the entropy u/rho^(gamma - 1)", false, offsetof(struct sph, equation)},
    {"viscosity", PARAM_CHOICE, "", "monaghan", 0, 0, "monaghan|signal",
     "by h v.r/r^2 of a pair (Monaghan & Gingold 1983), or by its speed of approach (Monaghan 1997)", false,
     offsetof(struct sph, viscosity)},
    {"strength", PARAM_CHOICE, "", "constant|shocks", 0, 0, "constant|shocks",
     "of the viscosity: alpha, or between alpha_min and alpha, by how fast div v falls (Cullen & Dehnen 2010)", false,
     offsetof(struct sph, strength)},
    {"alpha_min", PARAM_REAL, "", "0|0.1", 0, 100, NULL, "least viscosity with strength: shocks", true,
     offsetof(struct sph, alpha_min)},
    {"alpha", PARAM_REAL, "", "1|0.5", 0, 100, NULL, "linear artificial viscosity", true, offsetof(struct sph, alpha)},
    {"beta", PARAM_REAL, "", "2", 0, 100, NULL, "quadratic artificial viscosity", true, offsetof(struct sph, beta)},
    {"conduction", PARAM_REAL, "", "0", 0, 100, NULL,
     "alpha_u of the artificial conduction, which spreads jumps of u (Price 2008); 0: none", true,
     offsetof(struct sph, conduction)},
    {"epsilon", PARAM_REAL, "", "0.01", 1e-6, 1, NULL,
     "softens the approach rate of a pair: r^2 + epsilon h^2", true, offsetof(struct sph, epsilon)},
    {"balsara", PARAM_FLAG, "", "on", 0, 0, NULL, "lessen the viscosity where shear dominates", false,
     offsetof(struct sph, balsara)},
    {"balsara_epsilon", PARAM_REAL, "", "1e-4", 0, 1, NULL,
     "keeps the Balsara factor from 0/0: epsilon c/h beside div v and curl v", true,
     offsetof(struct sph, balsara_epsilon)},
    {"eos", PARAM_CHOICE, "", "adiabatic", 0, 0, "adiabatic|isothermal|barotropic",
     "adiabatic: P = (gamma - 1) rho u; without an energy equation isothermal: P = c^2 rho; "
     "barotropic: c^2 rho [1 + (rho/stiff_density)^(2/3)]", false,
     offsetof(struct sph, eos)},
    {"gamma", PARAM_REAL, "", "1.6666666666666667", 1.0001, 10, NULL, "adiabatic index", false,
     offsetof(struct sph, gamma)},
    {"mu", PARAM_REAL, "", "0.6", 0.1, 10, NULL, "mean molecular weight, for temperatures where no other module knows it: "
     "0.6 ionised, 1.3 neutral, 2 H2, 2.33 H2 with helium", false, offsetof(struct sph, mu)},
    {"sound_speed", PARAM_REAL, "velocity", "none", 1e-300, 1e300, NULL, "of isothermal gas; of thin barotropic gas", false,
     offsetof(struct sph, sound_speed)},
    {"stiff_density", PARAM_REAL, "density", "none", 1e-300, 1e300, NULL,
     "barotropic gas resists compression beyond this density", false, offsetof(struct sph, stiff_density)},
    {"courant", PARAM_REAL, "", "0.3", 0.001, 2, NULL,
     "C in the step C h / (signal velocity); on the front of doc/charts/time.csv: Evrard, leapfrog", true,
     offsetof(struct sph, courant)},
    {"acceleration", PARAM_REAL, "", "0.25", 0.001, 2, NULL, "eta in the step eta sqrt(2h/|a|)", true,
     offsetof(struct sph, acceleration)},
    {"step_ratio", PARAM_COUNT, "", "4", 1, 1 << 20, NULL,
     "most by which the steps of neighbours differ (Saitoh & Makino 2009), a power of two", true, offsetof(struct sph, step_ratio)},
    {"group_size", PARAM_COUNT, "", "512", 8, SPH_BATCH, NULL, "largest number of rows that share a neighbour search",
     true, offsetof(struct sph, group_size)},
    {"preset", PARAM_CHOICE, "", "classic", 0, 0, "classic|modern",
     "the defaults of the others, where they stand as classic|modern; modern from doc/charts/sph.csv", false,
     offsetof(struct sph, preset)},
    {0}
};

static const struct saved saved[] = {{"taken", offsetof(struct sph, taken), sizeof(double)}, {0}};

static const struct sph_loops *const loops[N_ISA] = {&sph_loops_v2, &sph_loops_v3, &sph_loops_v4};

static const char *eos_name(const struct sph *sph)
{
    static const char *const words[] = {[SPH_ADIABATIC] = "adiabatic", [SPH_ISOTHERMAL] = "isothermal",
                                        [SPH_BAROTROPIC] = "barotropic"};
    return words[sph->eos];
}

void sph_need_energy(struct sim *sim, const char *module)
{
    const struct sph *sph = sim_state(sim, "sph");
    if (sph->eos != SPH_ADIABATIC)
        problems_add(&sim->problems, "%s: %s needs gas with an energy equation: sph.eos is %s",
                     scene_place(sim->scene, "sph", "eos"), module, eos_name(sph));
}

/* Keys that would be read and then ignored. */
static void check_meaning(struct sim *sim, const struct sph *sph)
{
    const struct { bool ignored; const char *key, *needs; } rule[] = {
        {sim->time.classic, "courant", "time.criterion: signal"},
        {sim->time.classic, "acceleration", "time.criterion: signal"},
        {sph->strength == SPH_CONSTANT, "alpha_min", "sph.strength: shocks"},
        {sim->time.common, "step_ratio", "time.steps: individual"},
        {!sph->balsara, "balsara_epsilon", "sph.balsara: on"},
        {sph->eos != SPH_ADIABATIC, "gamma", "sph.eos: adiabatic"},
        {sph->eos != SPH_ADIABATIC, "conduction", "sph.eos: adiabatic"},
    };
    for (size_t r = 0; r < sizeof rule / sizeof *rule; r++)
        if (rule[r].ignored && param_chosen(sim->scene, "sph", params, rule[r].key))
            problems_add(&sim->problems, "%s: sph.%s has a meaning only with %s", scene_place(sim->scene, "sph", rule[r].key),
                         rule[r].key, rule[r].needs);
}

/* What does not go together. */
static void check_values(struct sim *sim, const struct sph *sph)
{
    struct problems *problems = &sim->problems;
    if (sph->eos == SPH_ADIABATIC && !isnan(sph->sound_speed))
        problems_add(problems, "sph.sound_speed has a meaning only with sph.eos: isothermal or barotropic");
    if (sph->eos != SPH_ADIABATIC && isnan(sph->sound_speed))
        problems_add(problems, "sph.eos: %s needs sph.sound_speed", eos_name(sph));
    if (isnan(sph->stiff_density) == (sph->eos == SPH_BAROTROPIC))
        problems_add(problems, sph->eos == SPH_BAROTROPIC ? "sph.eos: barotropic needs sph.stiff_density"
                               : "sph.stiff_density has a meaning only with sph.eos: barotropic");
    if (sph->grad_h && sph->count != SPH_SMOOTH)
        problems_add(problems, "sph.grad_h: on needs sph.count: smooth, where h follows the density");
    if (sph->equation == SPH_ENTROPY && sph->eos != SPH_ADIABATIC)
        problems_add(problems, "sph.equation: entropy has a meaning only with sph.eos: adiabatic");
    if (sph->equation == SPH_ENTROPY && !sph->grad_h)
        problems_add(problems, "sph.equation: entropy needs sph.grad_h: on, without which energy would not be conserved");
    if ((sph->step_ratio & (sph->step_ratio - 1)) != 0)
        problems_add(problems, "sph.step_ratio = %lld is not a power of two, as all steps are", (long long)sph->step_ratio);
    if (sph->strength == SPH_SHOCKS && sph->alpha_min > sph->alpha)
        problems_add(problems, "sph.alpha_min = %g is larger than sph.alpha = %g", sph->alpha_min, sph->alpha);
}

/* Most rows of a cell whose neighbours are looked for together. */
enum { LEAF_ROWS = 32 };

static void declare(struct sim *sim, void *state)
{
    struct sph *sph = state;
    struct species *gas = &sim->species[GAS];
    const enum column always[] = {COLUMN_h, COLUMN_rho, COLUMN_div_v, COLUMN_curl_v, COLUMN_signal, COLUMN_next_rung};
    for (size_t c = 0; c < sizeof always / sizeof *always; c++) species_need(gas, always[c]);
    if (sph->balsara || sph->strength == SPH_SHOCKS) species_need(gas, COLUMN_balsara);
    if (sph->strength == SPH_SHOCKS) species_need(gas, COLUMN_strength);
    if (sph->grad_h) species_need(gas, COLUMN_omega);
    species_need(gas, COLUMN_du);
    if (sph->eos == SPH_ADIABATIC) species_need(gas, COLUMN_u);
    check_values(sim, sph);
    check_meaning(sim, sph);
    tree_need(&sim->tree, NODE_h_max, 1);
    tree_need_leaf(&sim->tree, LEAF_ROWS);
    sph->loops = loops[isa_now()];
    sph->levels = 63 - __builtin_clzll((unsigned long long)sph->step_ratio);
    sph->meet = sph->grad_h ? (struct sph_meet){0, 2, 2} : (struct sph_meet){1, 0, 1};
    sph->excess = sph_kernel_excess((float)sph->neighbours, sph->kernel) * sph_kernel(0, sph->kernel);
}

/* A pair's terms go from h^-4 to m h^-5 and u/rho, in floats of the scene's units: these must leave room
 * for a collapse by a thousand in h on either side. */
static void check_units(struct sim *sim, const struct sph *sph)
{
    static const double room = 1e25;
    const struct species *gas = &sim->species[GAS];
    if (gas->n == 0) return;
    double mass = 0, volume = 1, most[7];       /* of -x, x, and u */
    for (int k = 0; k < 6; k++) most[k] = -INFINITY;
    most[6] = gas->u ? 0 : sph->sound_speed * sph->sound_speed;
    for (int64_t i = species_from(gas); i < species_to(gas); i++) {
        mass += gas->mass[i] / (double)gas->n;
        if (gas->u) most[6] = fmax(most[6], (double)gas->u[i]);
        for (int k = 0; k < 3; k++) {
            most[k] = fmax(most[k], -gas->pos[i][k]);
            most[3 + k] = fmax(most[3 + k], gas->pos[i][k]);
        }
    }
    ranks_sum(sim, &mass, 1);
    ranks_max(sim, most, 7);
    const double u = most[6];
    for (int k = 0; k < 3; k++) volume *= most[3 + k] + most[k];
    if (!(volume > 0)) return;      /* a row, a line or a plane: no scale to judge by */
    double spacing = cbrt(volume / (double)gas->n), rho = mass / pow(spacing, 3);
    const double terms[] = {pow(spacing, 4), mass / pow(spacing, 5), mass, rho, u > 0 ? u / rho : 1};
    for (size_t t = 0; t < sizeof terms / sizeof *terms; t++) {
        if (terms[t] < room && terms[t] > 1 / room) continue;
        problems_add(&sim->problems, "sph: in the scene's units rows of %g in mass lie %g apart: single precision does not "
                     "hold their forces; choose units of length and mass nearer to these", mass, spacing);
        return;
    }
}

/* T = P/rho mu m_p/k_B; P/rho in units of velocity squared. */
static double kelvin_of(const struct sim *sim, const struct sph *sph, double pressure)
{
    return pressure * sim->units.velocity * sim->units.velocity * sph->mu * CONST_M_PROTON / CONST_K_B;
}

static double kelvin(const struct sim *sim, const void *state)
{
    const struct sph *sph = state;
    return kelvin_of(sim, sph, sph->gamma - 1);
}

static void temperature(const struct sim *sim, const void *state, float *kelvin)
{
    const struct sph *sph = state;
    const struct species *gas = &sim->species[GAS];
#pragma omp parallel for
    for (int64_t i = species_from(gas); i < species_to(gas); i++) {
        double heat = sph_heat(sph, gas->u ? (double)gas->u[i] : 0, (double)gas->rho[i]);
        kelvin[i - species_from(gas)] = (float)kelvin_of(sim, sph, heat);
    }
}

static void begin(struct sim *sim, void *state)
{
    check_units(sim, state);
    if (sph_uses_device(sim)) sim->whole = "SPH on a device";
    else if (sim->device) log_line("sph: the CPU's in a closed box");
}

static void give_room(struct sim *sim, void *state)
{
    if (steps_rebuild_due(sim)) sph_drop_lists(state);
}

static void end(struct sim *sim, void *state)
{
    (void)sim;
    sph_free_batches(state);
}

/* Pressure and viscosity do work on gas whose temperature the density alone decides: what keeps it so takes that away. As
 * the integrators do with u, the mean of both rates acts over the step. */
static void book_taken(struct sim *sim, void *state)
{
    struct sph *sph = state;
    const struct species *gas = &sim->species[GAS];
    if (sph->eos == SPH_ADIABATIC) return;
    rows_here(sim, GAS_BIT, COL(mass) | COL(du) | COL(du_old) | COL(rung0), 0);
    double taken = 0;
    for (int64_t a = 0; a < gas->n_active; a++) {
        const int64_t i = gas->active[a];
        taken += 0.5 * gas->mass[i] * ((double)gas->du_old[i] + (double)gas->du[i]) * timeline_step(&sim->time, gas->rung0[i]);
    }
    comm_sum(&taken, 1);
    sph->taken += taken;
}

/* What is booked is that of all ranks, and a checkpoint gives it to each: one of them tells. */
static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct sph *sph = state;
    const struct species *gas = &sim->species[GAS];
    if (gas->u) sink->add(sink, "thermal", energy_of_rows(gas, gas->u));
    else sink->add(sink, "radiated", comm_rank() == 0 ? sph->taken : 0);
}

/* The cubic spline pairs particles beyond this number (Dehnen & Aly 2012). */
enum { CUBIC_NEIGHBOURS = 55 };

/* Sedov's explosion from one row, which keeps a quarter of it (doc/manual/problems.md); from 32 rows the shock is right. */
static const double hot_share = 0.1;

static void warn_of_hot_row(const struct sim *sim, const struct species *gas)
{
    double all = 0, most = 0;
    for (int64_t i = species_from(gas); gas->u && i < species_to(gas); i++) {
        double energy = gas->mass[i] * (double)gas->u[i];
        all += energy;
        most = fmax(most, energy);
    }
    ranks_sum(sim, &all, 1);
    ranks_max(sim, &most, 1);
    if (gas->n > 1 / hot_share && most > hot_share * all)
        log_warning("sph: one row of gas holds %.0f %% of the thermal energy: by pressure alone it shares it late, and not all "
                    "of it; give it to more rows, or set sph.conduction = 0.1", 100 * most / all);
}

/* h/|v| of the classic criterion shortens the steps of gas that merely moves. */
static void warn_of_boost(const struct sim *sim, const struct species *gas, const struct sph *sph)
{
    double sum[5] = {0};        /* momentum, mass, m c^2 */
    for (int64_t i = species_from(gas); i < species_to(gas); i++) {
        double c = (double)sph_sound_speed(sph, gas->u ? gas->u[i] : 0, 0);
        sum[3] += gas->mass[i];
        sum[4] += gas->mass[i] * c * c;
        for (int k = 0; k < 3; k++) sum[k] += gas->mass[i] * gas->vel[i][k];
    }
    ranks_sum(sim, sum, 5);
    double mach = sqrt((sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / (sum[3] * sum[4]));
    if (mach > 2)
        log_warning("time.criterion: classic: the gas moves as a whole at %.3g times its speed of sound, and h/|v| makes its steps "
                    "as much shorter; criterion: signal does not", mach);
}

/* Without Balsara's switch the viscosity is one of shear too: about alpha c h/10 (tests/scenes/boundaries.py disc). A gas is
 * taken for a disc where most of its motion is about one axis through the origin. */
static void warn_of_shear(const struct sim *sim, const struct species *gas, const struct sph *sph)
{
    double sum[4] = {0};        /* angular momentum, and the most that it could be */
    for (int64_t i = species_from(gas); i < species_to(gas); i++) {
        const double *x = gas->pos[i], *v = gas->vel[i], m = gas->mass[i];
        double l[3] = {x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]};
        for (int k = 0; k < 3; k++) sum[k] += m * l[k];
        sum[3] += m * sqrt((x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    }
    ranks_sum(sim, sum, 4);
    if (sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) > 0.5 * sum[3])
        log_warning("sph.balsara = off: this gas rotates, and loses its angular momentum as by a viscosity of %.3g c h",
                    sph->alpha / 10);
}

static void warn(struct sim *sim, void *state)
{
    const struct sph *sph = state;
    if (sim->species[GAS].n == 0) log_warning("sph: there is no gas in this scene");
    else if (sim->species[GAS].n <= sph->neighbours)
        log_warning("sph: %lld rows of gas are fewer than the %lld neighbours that each should have: h is a guess",
                    (long long)sim->species[GAS].n, (long long)sph->neighbours);
    if (sph->kernel == SPH_CUBIC && sph->neighbours >= CUBIC_NEIGHBOURS)
        log_warning("sph.neighbours = %lld: with the cubic spline particles pair from about %d neighbours on",
                    (long long)sph->neighbours, CUBIC_NEIGHBOURS);
    if (sph->alpha < 0.5) log_warning("sph.alpha = %g: shocks will ring and particles pass through each other", sph->alpha);
    if (sph->step_ratio > 4)
        log_warning("sph.step_ratio = %lld: a shock runs into gas that sleeps", (long long)sph->step_ratio);
    if (sph->conduction >= 1 && !sim->time.common)
        log_warning("sph.conduction = %g: a hot row gives away half of its energy in a step, and its neighbours' steps differ: "
                    "energy errors of 1 %% and more", sph->conduction);
    if (!sph->balsara && sph->strength == SPH_CONSTANT && sph->alpha > 0) warn_of_shear(sim, &sim->species[GAS], sph);
    if (sim->time.classic) warn_of_boost(sim, &sim->species[GAS], sph);
    if (!(sph->conduction > 0)) warn_of_hot_row(sim, &sim->species[GAS]);
    if (sph->courant > 0.5) log_warning("sph.courant = %g: sound crosses more than h/4 in a step", sph->courant);
}

const struct module sph_module = {
    .name = "sph", .doc = "smoothed particle hydrodynamics of the gas", .kind = MODULE_BLOCK,
    .params = params, .state_bytes = sizeof(struct sph), .saved = saved,
    .declare = declare, .begin = begin, .end = end, .energy = energy, .temperature = temperature, .kelvin = kelvin,
    .reason = sph_reason, .warn = warn, .resident = true,
    .hook = {[HOOK_PREDICT] = give_room, [HOOK_H] = sph_smooth, [HOOK_DENSITY] = sph_density, [HOOK_FORCE] = sph_force,
             [HOOK_CORRECT] = book_taken, [HOOK_LIMIT] = sph_limit},
};
