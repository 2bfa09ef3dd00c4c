/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `star_formation`: gas rows that collapse turn part of their mass into a new star row at their
 * place (doc/manual/star-formation.md). `jeans`: once |E_gr| > E_th + E_ch for a free-fall time (Berczik
 * 1999); `schmidt`: at random, with the rate c rho/t_ff (Katz 1992). */
#include "comm.h"
#include "constants.h"
#include "cooling.h"
#include "gravity/contact.h"
#include "mem.h"
#include "module.h"
#include "nearest.h"
#include "random.h"
#include "ranks.h"
#include "sph/sph.h"
#include "steps.h"
#include <math.h>

enum criterion { JEANS, SCHMIDT };

struct star_formation {
    /* Parameters. */
    int criterion;
    double n_h, largest_part, rate, spawned, least, time_step;
    bool converging;
    /* State. */
    double rho_least;           /* density above which stars form */
    double gas_mass;            /* mean mass of a gas row at the start */
    double formed, told, at;    /* mass of all stars formed, and at the last row of budget.csv with its time */
    double thermal, bound;      /* thermal energy that went with it; by how much the births lowered the potential energy */
    double untold;              /* of that, by this step's births, what the potentials of the other rows do not know yet */
};

static const struct param params[] = {
    {"criterion", PARAM_CHOICE, "", "jeans", 0, 0, "jeans|schmidt",
     "jeans: gas that has been bound against heat and motion for a free-fall time; schmidt: at random, rate rho/t_ff",
     false, offsetof(struct star_formation, criterion)},
    {"density", PARAM_REAL, "number_density", "0.03 cm^-3", 0, 1e300, NULL,
     "stars form where there are more hydrogen nuclei in a volume (76 % of the mass, or cooling.hydrogen)", true,
     offsetof(struct star_formation, n_h)},
    {"efficiency", PARAM_REAL, "", "0.4", 1e-6, 0.99, NULL, "jeans: largest part of a row that becomes stars at once", true,
     offsetof(struct star_formation, largest_part)},
    {"rate", PARAM_REAL, "", "0.1", 0, 100, NULL, "schmidt: part of the gas that becomes stars in a free-fall time", true,
     offsetof(struct star_formation, rate)},
    {"spawned", PARAM_REAL, "", "0.33", 0.01, 1, NULL, "schmidt: mass of a star row in mean gas rows of the start", true,
     offsetof(struct star_formation, spawned)},
    {"converging", PARAM_FLAG, "", "on", 0, 0, NULL, "schmidt: only where the gas does not expand", true,
     offsetof(struct star_formation, converging)},
    {"least", PARAM_REAL, "", "0.1", 0.01, 1, NULL,
     "gas rows are left with at least this part of the mean gas row of the start", true,
     offsetof(struct star_formation, least)},
    {"time_step", PARAM_REAL, "", "0.1", 1e-4, 10, NULL,
     "eta of the longest step eta (sqrt(8) eps/|da/dt|)^(1/3) of stars born in the run, which fall through the middle of their "
     "clumps, where gravity.time_step sees no acceleration", true, offsetof(struct star_formation, time_step)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct star_formation, field), sizeof(double)}
static const struct saved saved[] = {SAVED(gas_mass), SAVED(formed), SAVED(told), SAVED(at), SAVED(thermal), SAVED(bound), {0}};
#undef SAVED

static const char *const requires[] = {"sph", NULL};

/* A star's id is its parent's with the number of the birth in the upper 16 bits. */
enum { BIRTH_BIT = 48 };
enum { NEIGHBOURS = 50 };       /* for the motion within a row's surroundings: those of sph by default */

static void declare(struct sim *sim, void *state)
{
    (void)state;
    static const enum column of_stars[] = {COLUMN_birth, COLUMN_mass_born, COLUMN_age_paid};
    for (int c = 0; c < 3; c++) species_need(&sim->species[STAR], of_stars[c]);
    sim->species[STAR].grows = true;
    species_need(&sim->species[GAS], COLUMN_children);
    species_need(&sim->species[GAS], COLUMN_collapse);
    sph_need_energy(sim, "star_formation");
    if (!sim->units.physical)
        problems_add(&sim->problems, "star_formation needs physical units: this scene is dimensionless");
}

static void begin(struct sim *sim, void *state)
{
    struct star_formation *sf = state;
    const struct species *gas = &sim->species[GAS];
    sf->rho_least = sf->n_h * CONST_M_PROTON / sim->units.mass / cooling_hydrogen(sim);
    if (gravity_gas_is_adaptive(sim))
        fail(STATUS_INPUT, "star_formation: what a star's softening costs is known for gas of one softening: "
                           "gravity.softening_adaptive must be off");
    if (sim_state(sim, "gravity") && gravity_contact(sim, GAS, STAR) == 0)
        fail(STATUS_INPUT, "star_formation: a star begins at the place of its gas: gravity.softening must be above 0");
    if (sf->gas_mass > 0) return;
    sf->at = timeline_now(&sim->time);
    for (int64_t i = 0; i < gas->n; i++) {
        sf->gas_mass += gas->mass[i] / (double)gas->n;
        if (gas->id[i] >> BIRTH_BIT)
            fail(STATUS_INPUT, "gas particle %llu: star_formation needs ids below 2^%d", (unsigned long long)gas->id[i], BIRTH_BIT);
    }
}

static double free_fall_time(const struct sim *sim, int64_t i)
{
    return sqrt(3 * acos(-1) / (32 * sim->units.G * (double)sim->species[GAS].rho[i]));
}

/* Mean square velocity of the surroundings relative to the row. */
static double motion2(const struct sim *sim, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    struct nearest nearest;
    double sum = 0;
    nearest_gas(sim, gas->pos[i], NEIGHBOURS, &nearest);
    for (int k = 0; k < nearest.n; k++) {
        int32_t j = nearest.row[k];
        double lag = timeline_lag(&sim->time, gas->rung[j], gas->rung0[j]);
        for (int x = 0; x < 3; x++) {
            double v = integrate_velocity(gas->vel[j][x], (double)gas->acc[j][x], lag) - gas->vel[i][x];
            sum += v * v;
        }
    }
    return nearest.n > 1 ? sum / (nearest.n - 1) : 0;
}

/* 1 - (E_th + E_ch)/|E_gr| with E_gr = -G m^2/h, E_th = 3/2 m P/rho, E_ch = 1/2 m (rms velocity)^2; cheap
 * tests come first. */
static double bound_part(const struct sim *sim, int64_t i)
{
    const struct species *gas = &sim->species[GAS];
    const struct sph *sph = sim_state(sim, "sph");
    double depth = sim->units.G * gas->mass[i] / (double)gas->h[i];
    double heat = 1.5 * (sph->gamma - 1) * (double)gas->u[i];
    if (heat >= depth) return 0;
    if (sim_state(sim, "cooling") && cooling_time(sim, i) > free_fall_time(sim, i)) return 0;
    return 1 - (heat + 0.5 * motion2(sim, i)) / depth;
}

/* Mass that becomes stars now, if births are due; the clock of the collapse goes on or back. */
static double jeans_mass(struct sim *sim, const struct star_formation *sf, int64_t i, double dt, bool due)
{
    struct species *gas = &sim->species[GAS];
    double part = (double)gas->rho[i] > sf->rho_least ? bound_part(sim, i) : 0;
    gas->collapse[i] = part > 0 ? gas->collapse[i] + (float)dt : 0;
    if (!due || !(part > 0) || (double)gas->collapse[i] < free_fall_time(sim, i)) return 0;
    gas->collapse[i] = 0;
    return fmin(part, sf->largest_part) * gas->mass[i];
}

/* The expectation is (1 - exp(-c t/t_ff)) m, t the time since the last draw in which the gas could form stars. */
static double schmidt_mass(struct sim *sim, const struct star_formation *sf, int64_t i, double dt, bool due)
{
    struct species *gas = &sim->species[GAS];
    const struct random key = {sim->seed, gas->id[i], (uint64_t)sim->time.tick, random_stream("star_formation")};
    if ((double)gas->rho[i] < sf->rho_least || (sf->converging && gas->div_v[i] > 0)) return 0;
    gas->collapse[i] += (float)dt;
    if (!due) return 0;
    double mass = fmin(sf->spawned * sf->gas_mass, gas->mass[i]);
    double expected = -expm1(-sf->rate * (double)gas->collapse[i] / free_fall_time(sim, i)) * gas->mass[i];
    gas->collapse[i] = 0;
    return random_uniform(&key, 0) < expected / mass ? mass : 0;
}

static void copy_state(struct sim *sim, int64_t from, int64_t to)
{
    const struct species *gas = &sim->species[GAS];
    struct species *star = &sim->species[STAR];
    for (int k = 0; k < 3; k++) {
        star->pos[to][k] = gas->pos[from][k];
        star->vel[to][k] = gas->vel[from][k];
        star->acc[to][k] = gas->acc[from][k];
    }
    double step = timeline_seconds(&sim->time, (int64_t)1 << gas->rung[from]);
    int rung = timeline_rung(&sim->time, step);
    star->rung[to] = star->rung0[to] = (uint8_t)(rung > 0 ? rung : 0);
}

/* What one row was now attracts itself as two, at rest with each other, and the star has a softening of its own: energy that
 * came from nowhere. `rise` is what that softening makes of the potential; those of this step's force are of before. */
static void bind(struct sim *sim, struct star_formation *sf, int64_t i, int64_t to, double rise)
{
    struct species *gas = &sim->species[GAS], *star = &sim->species[STAR];
    double contact = gravity_contact(sim, GAS, STAR);
    if (star->pot) {
        star->pot[to] = gas->pot[i] + (float)(contact * gas->mass[i] + rise);
        gas->pot[i] += (float)(contact * star->mass[to]);
    }
    sf->bound -= (contact * gas->mass[i] + rise) * star->mass[to];
    sf->untold += 0.5 * rise * star->mass[to];
}

/* The star goes on with the row's acceleration until its first own force, and the row takes all of the heat that
 * its pressure yields until then: momentum and energy do not notice that the row has been divided. */
static void form(struct sim *sim, struct star_formation *sf, int64_t i, double mass)
{
    double rise = gravity_resoften(sim, GAS, i, STAR);
    int64_t to = ranks_append(sim, STAR, 1);
    struct species *gas = &sim->species[GAS], *star = &sim->species[STAR];
    double part = mass / gas->mass[i];
    copy_state(sim, i, to);
    gas->du[i] *= (float)(1 / (1 - part));
    star->id[to] = species_child(gas->id[i], ++gas->children[i]);
    star->mass[to] = star->mass_born[to] = mass;
    star->birth[to] = timeline_now(&sim->time);
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *of_gas = species_column(gas, (enum column)c), *of_star = species_column(star, (enum column)c);
        if (!of_gas || !of_star) continue;
        of_star[to] = part * of_gas[i];
        of_gas[i] -= of_star[to];
    }
    gas->mass[i] -= mass;
    sf->formed += mass;
    sf->thermal += mass * (double)gas->u[i];
    bind(sim, sf, i, to, rise);
}

/* All ranks do the same for the rows of all, so that new rows are the same everywhere. */
static void event(struct sim *sim, void *state)
{
    struct star_formation *sf = state;
    const struct species *gas = &sim->species[GAS];
    uint64_t keep = sim->want_potential ? (uint64_t)1 << COLUMN_pot : 0;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    sf->untold = 0;
    const bool due = steps_births_due(sim);
    double *mass = mem_array("star_formation", double, gas->n_ending);
#pragma omp parallel for schedule(dynamic, 64)
    for (int64_t e = 0; e < gas->n_ending; e++) {
        int64_t i = gas->ending[e];
        double dt = timeline_step(&sim->time, gas->rung0[i]);
        if (dt == 0 || gas->children[i] == UINT8_MAX || species_child(gas->id[i], 1) == 0) continue;
        mass[e] = sf->criterion == JEANS ? jeans_mass(sim, sf, i, dt, due) : schmidt_mass(sim, sf, i, dt, due);
    }
    for (int64_t e = 0; e < gas->n_ending; e++) {
        int64_t i = gas->ending[e];
        if (mass[e] > 0 && gas->mass[i] - mass[e] > sf->least * sf->gas_mass) form(sim, sf, i, mass[e]);
    }
    mem_free(mass);
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct star_formation *sf = state;
    const bool gravity = sim_state(sim, "gravity") != NULL;
    sink->add(sink, "booked_stars_heat", comm_rank() == 0 ? sf->thermal : 0);
    if (gravity) sink->add(sink, "booked_stars_bound", comm_rank() == 0 ? sf->bound + sf->untold : 0);
}

/* The rate is the mean since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct star_formation *sf = state;
    const double sun = sim->units.mass / CONST_M_SUN, year = units_cgs(&sim->units, "time") / CONST_YEAR;
    double now = timeline_now(&sim->time), rate = now > sf->at ? (sf->formed - sf->told) / (now - sf->at) * sun / year : 0;
    sink->add(sink, "sfr [Msun yr^-1]", comm_rank() == 0 ? rate : 0);
    sink->add(sink, "formed [Msun]", comm_rank() == 0 ? sf->formed * sun : 0);
    sf->told = sf->formed;
    sf->at = now;
}

/* In the middle of a clump the acceleration vanishes, but not its change. */
static void limit(struct sim *sim, void *state)
{
    const struct star_formation *sf = state;
    struct species *star = &sim->species[STAR];
    double contact = gravity_contact(sim, STAR, STAR);
    if (contact == 0) return;
    for (int64_t a = 0; a < star->n_active; a++) {
        int64_t i = star->active[a];
        double dt = timeline_step(&sim->time, star->rung0[i]), change2 = 0;
        if (!(star->id[i] >> BIRTH_BIT) || dt == 0) continue;
        for (int k = 0; k < 3; k++) {
            double change = (double)star->acc[i][k] - (double)star->acc_old[i][k];
            change2 += change * change;
        }
        double longest = sf->time_step * cbrt(sqrt(8 / change2) * (sim->units.G / -contact) * dt);
        star->dt[i] = fminf(star->dt[i], (float)longest);
    }
}

static void reason(const struct sim *sim, const void *state, const struct species *s, int64_t i, struct step_reason *step)
{
    (void)sim;
    (void)state;
    if (s->kind == STAR && s->id[i] >> BIRTH_BIT && (double)s->dt[i] < 0.999 * step->dt)
        *step = (struct step_reason){(double)s->dt[i], "star_formation.time_step"};
}

const struct module star_formation_module = {
    .name = "star_formation", .whole = true, .doc = "stars form from collapsing gas", .kind = MODULE_BLOCK,
    .params = params, .requires = requires, .state_bytes = sizeof(struct star_formation), .saved = saved,
    .declare = declare, .begin = begin, .energy = energy, .budget = budget, .reason = reason,
    .hook = {[HOOK_EVENT] = event, [HOOK_LIMIT] = limit},
};
