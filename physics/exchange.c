/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `exchange`: drag between cold clouds and gas, gas that condenses on clouds, clouds that evaporate
 * (doc/manual/exchange.md). What passes from one to the other takes its momentum, elements and energy with it. */
#include "clouds.h"
#include "comm.h"
#include "conduction.h"
#include "constants.h"
#include "cooling.h"
#include "deposit.h"
#include "gravity/contact.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include "sph/sph.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum branches { SMOOTH, SHARP, NONE };
enum ledger { CONDENSED, EVAPORATED, DISSOLVED, MERGED, SPLIT, CUT, N_LEDGERS };

struct exchange {
    /* Parameters. */
    int branches;
    double drag, part, temperature, coldest, least, light, heavy, change, transition, every;
    int64_t neighbours;
    /* State. */
    struct conduction law;
    struct deposit_wishes wishes;
    double suns, years, pc;                 /* code units in Msun, years, pc */
    double kelvin, particles;               /* T of a unit of u; cm^-3 of a unit of density: mean molecular weight 0.61 */
    double u_cloud;                         /* specific internal energy of what evaporates */
    int rung;                               /* of `every` */
    double gas_mass;                        /* mean mass of a gas row at the start */
    double radiated, brought, heat;         /* energy of gas that condensed; of clouds that evaporated; heat of the drag */
    double sum[N_LEDGERS], told[N_LEDGERS], at;
    double formed;                          /* mass of gas that became clouds */
    double lifted;                          /* fall of the potential energy of what went from clouds to gas and back */
    float *longest;                         /* step of rows whose step ends */
    int64_t rows;
};

static const struct param params[] = {
    {"drag", PARAM_REAL, "", "0.5", 0, 10, NULL, "drag coefficient of a cloud in gas", true, offsetof(struct exchange, drag)},
    {"conduction", PARAM_CHOICE, "", "smooth", 0, 0, "smooth|sharp|none",
     "condensation and evaporation, blended where they meet; as published, with a jump; or none", true,
     offsetof(struct exchange, branches)},
    {"part", PARAM_REAL, "", "1", 1e-6, 1, NULL, "of the conductivity that magnetic fields leave", true,
     offsetof(struct exchange, part)},
    {"coldest", PARAM_REAL, "temperature", "0 K", 0, 1e12, NULL,
     "gas that is colder does not condense (below 1e5 K nothing evaporates in any case)", true, offsetof(struct exchange, coldest)},
    {"temperature", PARAM_REAL, "temperature", "100 K", 1, 1e5, NULL, "of clouds", true, offsetof(struct exchange, temperature)},
    {"least", PARAM_REAL, "mass", "100 Msun", 0, 1e300, NULL, "clouds of less mass dissolve", true, offsetof(struct exchange, least)},
    {"neighbours", PARAM_COUNT, "", "50", 1, NEAREST_MOST, NULL, "gas rows that a cloud exchanges with", true,
     offsetof(struct exchange, neighbours)},
    {"every", PARAM_REAL, "time", "0 yr", 0, 1e300, NULL,
     "clouds with shorter steps exchange all at once, so often or, rounded to a step, more often", true,
     offsetof(struct exchange, every)},
    {"change", PARAM_REAL, "", "0.1", 1e-4, 0.5, NULL, "part of its mass that a gas row gives in a step, at most", true,
     offsetof(struct exchange, change)},
    {"light", PARAM_REAL, "", "0.2", 0, 1, NULL, "gas rows of less than this part of the mean one of the start join a neighbour", true,
     offsetof(struct exchange, light)},
    {"heavy", PARAM_REAL, "", "2", 1.5, 1e300, NULL, "gas rows of more than this many are split into two", true,
     offsetof(struct exchange, heavy)},
    {"transition", PARAM_REAL, "number_density", "none", 1e-300, 1e300, NULL,
     "cold, contracting, unstable gas with more hydrogen nuclei (76 % of the mass, or cooling.hydrogen) in a volume becomes "
     "clouds; default: none", true,
     offsetof(struct exchange, transition)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct exchange, field), sizeof((struct exchange *)0)->field}
static const struct saved saved[] = {SAVED(gas_mass), SAVED(radiated), SAVED(brought), SAVED(heat), SAVED(sum), SAVED(told),
                                     SAVED(at), SAVED(formed), SAVED(lifted), {0}};
#undef SAVED

static const char *const requires[] = {"sph", "clouds", NULL};

static void declare(struct sim *sim, void *state)
{
    struct species *gas = &sim->species[GAS], *cloud = &sim->species[CLOUD];
    gas->grows = gas->shrinks = cloud->shrinks = true;
    species_need(gas, COLUMN_children);
    if (!isnan(((const struct exchange *)state)->transition)) cloud->grows = true;
    sph_need_energy(sim, "exchange");
}

static void begin(struct sim *sim, void *state)
{
    struct exchange *x = state;
    if (gravity_gas_is_adaptive(sim))
        fail(STATUS_INPUT, "exchange: what a change of softening costs the mass that passes is known for gas of one softening: "
                           "gravity.softening_adaptive must be off");
    const struct sph *sph = sim_state(sim, "sph");
    const struct species *gas = &sim->species[GAS];
    const double hot = 0.61, cold = 2;      /* mean molecular weights: ionised gas, molecules */
    const double cm = sim->units.length, per_gram = CONST_K_B / ((sph->gamma - 1) * CONST_M_PROTON);
    x->suns = sim->units.mass / CONST_M_SUN;
    x->years = units_cgs(&sim->units, "time") / CONST_YEAR;
    x->pc = sim->units.length / CONST_PC;
    x->kelvin = units_cgs(&sim->units, "specific_energy") * hot / per_gram;
    x->particles = sim->units.mass / (cm * cm * cm) / (hot * CONST_M_PROTON);
    x->u_cloud = per_gram * x->temperature / cold / units_cgs(&sim->units, "specific_energy");
    x->law = (struct conduction){clouds_radius(sim, 1e6 / x->suns) * x->pc,
                                 log10(clouds_radius(sim, 1e7 / x->suns) / clouds_radius(sim, 1e6 / x->suns)), x->part,
                                 x->branches == SHARP};
    if (x->branches != NONE && !(x->law.power > 0))
        fail(STATUS_INPUT, "clouds.power: must be above 0 where clouds condense and evaporate");
    for (x->rung = RUNG_TOP; x->rung > 0 && timeline_seconds(&sim->time, (int64_t)1 << x->rung) > x->every;) x->rung--;
    if (x->gas_mass > 0) return;
    x->at = timeline_now(&sim->time);
    for (int64_t i = 0; i < gas->n; i++) {
        x->gas_mass += gas->mass[i] / (double)gas->n;
        if (species_child(gas->id[i], 1) == 0 || gas->id[i] >> 48)
            fail(STATUS_INPUT, "gas particle %llu: exchange needs ids below 2^48", (unsigned long long)gas->id[i]);
    }
}

static void end(struct sim *sim, void *state)
{
    struct exchange *x = state;
    (void)sim;
    deposit_free(&x->wishes);
    mem_free(x->longest);
}

/* --- one cloud --- */

/* The gas about a cloud: means with the shares; mass: that whose relative change is the rows' mean one. */
struct bath { struct nearest nearest; double vel[3], u, rho, mass, most; };

static bool find_bath(const struct sim *sim, const struct exchange *x, int32_t row, struct bath *bath)
{
    const struct species *cloud = &sim->species[CLOUD];
    if (species_gone(cloud, row)) return false;
    nearest_gas(sim, cloud->pos[row], (int)x->neighbours, &bath->nearest);
    return deposit_reaches(sim, &bath->nearest);
}

/* As it is when the cloud's turn comes: others have changed it. */
static void measure_bath(const struct sim *sim, struct bath *bath)
{
    const struct species *gas = &sim->species[GAS];
    double share[NEAREST_MOST], vel[3], inverse = 0, largest = 0;
    deposit_shares(sim, &bath->nearest, share);
    bath->u = bath->rho = 0;
    memset(bath->vel, 0, sizeof bath->vel);
    for (int k = 0; k < bath->nearest.n; k++) {
        int32_t j = bath->nearest.row[k];
        deposit_velocity(sim, j, vel);
        bath->u += share[k] * (double)gas->u[j];
        bath->rho += share[k] * (double)gas->rho[j];
        for (int d = 0; d < 3; d++) bath->vel[d] += share[k] * vel[d];
        inverse += share[k] * share[k] / gas->mass[j];
        largest = fmax(largest, share[k] / gas->mass[j]);
    }
    bath->mass = 1 / inverse;
    bath->most = 1 / largest;
}

/* d|dv|/dt = -C pi h^2 rho (1/m + 1/M) |dv|^2: |dv|/(1 + ...). What kinetic energy is lost is heat of the gas. */
static void drag(struct sim *sim, struct exchange *x, int32_t row, const struct bath *bath, double dt)
{
    struct species *cloud = &sim->species[CLOUD];
    const double m = cloud->mass[row], h = clouds_radius(sim, m), mu = m * bath->mass / (m + bath->mass);
    double dv[3], speed = 0, impulse[3];
    for (int k = 0; k < 3; k++) {
        dv[k] = cloud->vel[row][k] - bath->vel[k];
        speed += dv[k] * dv[k];
    }
    speed = sqrt(speed);
    double slower = 1 / (1 + x->drag * acos(-1) * h * h * bath->rho / mu * speed * dt);
    for (int k = 0; k < 3; k++) {
        impulse[k] = mu * (1 - slower) * dv[k];
        cloud->vel[row][k] -= impulse[k] / m;
    }
    double heat = 0.5 * mu * speed * speed * (1 - slower * slower);
    deposit_push(sim, &bath->nearest, impulse, heat, &x->wishes);
    x->heat += heat;
}

/* Of a mass that goes from a cloud to the gas. */
static void lift(struct sim *sim, struct exchange *x, int32_t row, const struct bath *bath, double mass)
{
    const struct random key = {sim->seed, sim->species[CLOUD].id[row], (uint64_t)sim->time.tick, random_stream("lift")};
    x->lifted -= deposit_rise(sim, &bath->nearest, CLOUD, row, mass, &key);
}

static void condense(struct sim *sim, struct exchange *x, int32_t row, const struct bath *bath, double mass)
{
    struct species *cloud = &sim->species[CLOUD];
    struct deposit drawn;
    const double old = cloud->mass[row], whole = old + mass;
    double before = 0, after = 0;
    lift(sim, x, row, bath, -mass);
    deposit_withdraw(sim, &bath->nearest, mass, &drawn);
    for (int k = 0; k < 3; k++) {
        before += 0.5 * old * cloud->vel[row][k] * cloud->vel[row][k];
        cloud->vel[row][k] += mass / whole * (drawn.vel[k] - cloud->vel[row][k]);
        after += 0.5 * whole * cloud->vel[row][k] * cloud->vel[row][k];
    }
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *element = species_column(cloud, (enum column)c);
        if (element) element[row] += drawn.element[c - FIRST_ELEMENT];
    }
    cloud->mass[row] = whole;
    x->radiated += drawn.energy + before - after;
    x->sum[CONDENSED] += mass;
}

static void evaporate(struct sim *sim, struct exchange *x, int32_t row, const struct bath *bath, double mass)
{
    struct species *cloud = &sim->species[CLOUD];
    struct deposit deposit = {.mass = mass, .energy = mass * x->u_cloud};
    double part = mass / cloud->mass[row];
    lift(sim, x, row, bath, mass);
    memcpy(deposit.pos, cloud->pos[row], sizeof deposit.pos);
    memcpy(deposit.vel, cloud->vel[row], sizeof deposit.vel);
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *element = species_column(cloud, (enum column)c);
        if (!element) continue;
        deposit.element[c - FIRST_ELEMENT] = part * element[row];
        element[row] -= deposit.element[c - FIRST_ELEMENT];
    }
    cloud->mass[row] -= mass;
    x->brought += deposit_to_gas(sim, &deposit, &bath->nearest, &x->wishes);
    x->sum[EVAPORATED] += mass;
}

static void conduct(struct sim *sim, struct exchange *x, int32_t row, const struct bath *bath, double dt)
{
    const struct species *cloud = &sim->species[CLOUD];
    const double m = cloud->mass[row], hot = 0.61, cold = 2;
    struct conduction_zones z = {m * x->suns, bath->mass * x->suns, bath->u * x->kelvin, bath->rho * x->particles,
                                 x->temperature * hot / cold};
    double gain = 0;
    if (z.T >= x->coldest) {
        const double most = x->change * bath->most, rate = conduction_rate(&x->law, z.T, z.n, z.cloud) / x->suns * x->years;
        x->longest[row] = (float)(most / fabs(rate));
        conduction_zones(&x->law, &z, dt * x->years);
        gain = z.cloud / x->suns - m;
        x->sum[CUT] += fmax(gain - most, 0);
        gain = fmin(gain, most);
    }
    if (gain > 0) condense(sim, x, row, bath, gain);
    bool dissolves = m + gain < x->least;
    if (!dissolves && gain < 0) evaporate(sim, x, row, bath, -gain);
    if (!dissolves) return;
    evaporate(sim, x, row, bath, cloud->mass[row]);
    ranks_remove(sim, CLOUD, row);
    x->sum[DISSOLVED]++;
}

/* --- gas rows of the wrong mass, and gas that becomes clouds --- */

/* All of a row goes to the nearest other one. */
static void merge(struct sim *sim, struct exchange *x, int32_t row)
{
    struct species *gas = &sim->species[GAS];
    struct nearest near, one = {.n = 1};
    double now[3], vel[3];
    sim_predict(&sim->time, gas, row, now);
    nearest_gas(sim, now, 2, &near);
    if (near.n < 2) return;
    int other = near.row[0] == row;
    one.row[0] = near.row[other];
    one.r2[0] = near.r2[other];
    deposit_velocity(sim, row, vel);
    struct deposit deposit = {.mass = gas->mass[row], .energy = gas->mass[row] * (double)gas->u[row],
                              .vel = {vel[0], vel[1], vel[2]}};
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        const double *element = species_column(gas, (enum column)c);
        if (element) deposit.element[c - FIRST_ELEMENT] = element[row];
    }
    deposit_to_gas(sim, &deposit, &one, &x->wishes);
    ranks_remove(sim, GAS, row);
    x->sum[MERGED]++;
}

/* Two equal rows, a fifth of h to each side; nothing else changes. */
static void split(struct sim *sim, struct exchange *x, int32_t row)
{
    struct species *gas = &sim->species[GAS];
    if (gas->children[row] == UINT8_MAX || species_child(gas->id[row], 1) == 0) return;
    const struct random key = {sim->seed, gas->id[row], (uint64_t)sim->time.tick, random_stream("exchange")};
    double away[3];
    random_direction(&key, 0, away);
    int64_t to = ranks_append(sim, GAS, 1);
    for (int c = 0; c < N_COLUMNS; c++) {
        char *column = species_column(gas, (enum column)c);
        size_t bytes = species_row_bytes((enum column)c);
        if (column) memcpy(column + (size_t)to * bytes, column + (size_t)row * bytes, bytes);
    }
    gas->id[to] = species_child(gas->id[row], ++gas->children[row]);
    gas->children[to] = 0;
    const int32_t both[2] = {row, (int32_t)to};
    for (int b = 0; b < 2; b++) {
        gas->mass[both[b]] *= 0.5;
        for (int k = 0; k < 3; k++) gas->pos[both[b]][k] += (b ? -0.2 : 0.2) * (double)gas->h[row] * away[k];
        for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
            double *element = species_column(gas, (enum column)c);
            if (element) element[both[b]] *= 0.5;
        }
    }
    tree_follow_rows(sim, GAS, &row, 1);
    x->sum[SPLIT]++;
}

static int ascending(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

static void mend_rows(struct sim *sim, struct exchange *x, int32_t *touched, int64_t n)
{
    struct species *gas = &sim->species[GAS];
    if (n > 0) qsort(touched, (size_t)n, sizeof *touched, ascending);
    for (int64_t k = 0; k < n; k++) {
        int32_t i = touched[k];
        if ((k > 0 && i == touched[k - 1]) || species_gone(gas, i)) continue;
        if (gas->mass[i] < x->light * x->gas_mass) merge(sim, x, i);
        else if (gas->mass[i] > x->heavy * x->gas_mass) split(sim, x, i);
    }
}

/* Jeans mass below that of a kernel (Bate & Burkert 1997): it can be no gas any more. */
static bool becomes_cloud(const struct sim *sim, const struct exchange *x, int64_t i)
{
    const struct sph *sph = sim_state(sim, "sph");
    const struct species *gas = &sim->species[GAS];
    const double hydrogen = cooling_hydrogen(sim), warm = 1.5e4, rho = (double)gas->rho[i], u = (double)gas->u[i];
    double n_h = hydrogen * rho * sim->units.mass / CONST_M_PROTON;
    double jeans = pow(2.5 * (sph->gamma - 1) * u / sim->units.G, 1.5) / sqrt(4 * acos(-1) / 3 * rho);
    return n_h > x->transition && u * x->kelvin < warm && gas->div_v[i] < 0 && jeans < (double)x->neighbours * gas->mass[i];
}

static void make_cloud(struct sim *sim, struct exchange *x, int64_t i)
{
    int64_t to = ranks_append(sim, CLOUD, 1);
    const struct species *gas = &sim->species[GAS];
    struct species *cloud = &sim->species[CLOUD];
    for (int c = 0; c < N_COLUMNS; c++) {
        char *target = species_column(cloud, (enum column)c), *source = species_column(gas, (enum column)c);
        size_t bytes = species_row_bytes((enum column)c);
        if (target && source) memcpy(target + (size_t)to * bytes, source + (size_t)i * bytes, bytes);
    }
    int rung = timeline_rung(&sim->time, timeline_seconds(&sim->time, (int64_t)1 << gas->rung[i]));
    cloud->rung[to] = cloud->rung0[to] = (uint8_t)(rung > 0 ? rung : 0);
    x->radiated += gas->mass[i] * (double)gas->u[i];
    x->formed += gas->mass[i];
    ranks_remove(sim, GAS, i);
}

/* --- the step --- */

static void make_clouds(struct sim *sim, struct exchange *x)
{
    const struct species *gas = &sim->species[GAS];
    for (int64_t e = 0; e < gas->n_ending && !isnan(x->transition); e++) {
        int32_t i = gas->ending[e];
        if (!species_gone(gas, i) && becomes_cloud(sim, x, i)) make_cloud(sim, x, i);
    }
}

static void reserve(struct exchange *x, const struct species *cloud)
{
    if (cloud->n > x->rows) {
        x->longest = mem_resize("exchange", x->longest, (size_t)cloud->capacity * sizeof *x->longest);
        x->rows = cloud->capacity;
    }
    for (int64_t e = 0; e < cloud->n_ending; e++) x->longest[cloud->ending[e]] = INFINITY;
}

/* The time for which a cloud whose step ends now exchanges: its step, or, of those that are shorter than `every`, all at once at
 * the ticks that this divides. The closed forms hold for any time. */
static double due(const struct sim *sim, const struct exchange *x, int32_t row)
{
    const int own = sim->species[CLOUD].rung0[row];
    if (own >= x->rung) return timeline_step(&sim->time, own);
    /* The end of the run, where all steps end, is not one of these ticks: a run that goes on exchanges for the whole time. */
    return timeline_divides(sim->time.tick, x->rung) ? timeline_step(&sim->time, x->rung) : 0;
}

/* All ranks hold all rows and do the same for the clouds of all, one after the other in row order; the search is shared
 * among threads. */
static void event(struct sim *sim, void *state)
{
    enum { BLOCK = 256 };
    struct exchange *x = state;
    const struct species *cloud = &sim->species[CLOUD];
    uint64_t keep = 0;
    const int64_t n = cloud->n_ending;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    reserve(x, cloud);
    struct bath *bath = mem_array("exchange", struct bath, n < BLOCK ? n : BLOCK);
    int32_t *touched = mem_array("exchange", int32_t, n * x->neighbours);
    int64_t count = 0;
    bool has[BLOCK];
    for (int64_t from = 0; from < n; from += BLOCK) {
        int64_t rows = n - from < BLOCK ? n - from : BLOCK;
#pragma omp parallel for schedule(dynamic, 4)
        for (int64_t k = 0; k < rows; k++)
            has[k] = due(sim, x, cloud->ending[from + k]) > 0 && find_bath(sim, x, cloud->ending[from + k], &bath[k]);
        for (int64_t k = 0; k < rows; k++) {
            int32_t row = cloud->ending[from + k];
            double dt = due(sim, x, row);
            if (!has[k]) continue;
            measure_bath(sim, &bath[k]);
            if (x->drag > 0) drag(sim, x, row, &bath[k], dt);
            if (x->branches != NONE) conduct(sim, x, row, &bath[k], dt);
            for (int j = 0; j < bath[k].nearest.n; j++) touched[count++] = bath[k].nearest.row[j];
        }
    }
    mend_rows(sim, x, touched, count);
    make_clouds(sim, x);
    mem_free(bath);
    mem_free(touched);
}

static void limit(struct sim *sim, void *state)
{
    struct exchange *x = state;
    struct species *cloud = &sim->species[CLOUD];
    deposit_wake(sim, &x->wishes);
    for (int64_t a = 0; a < cloud->n_active; a++) {
        int64_t i = cloud->active[a];
        cloud->dt[i] = fminf(cloud->dt[i], x->longest[i]);
    }
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct exchange *x = state;
    const double one = comm_rank() == 0;
    if (sim_state(sim, "gravity")) sink->add(sink, "booked_exchange_lifted", one * x->lifted);
    sink->add(sink, "radiated_condensed", one * x->radiated);
    sink->add(sink, "booked_clouds_heat", -one * x->brought);
}

/* Rates are the means since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct exchange *x = state;
    const double one = comm_rank() == 0, now = timeline_now(&sim->time), span = (now - x->at) * x->years;
    static const char *const mass[] = {"condensed", "evaporated"};
    static const char *const number[] = {"clouds_dissolved", "gas_merged", "gas_split"};
    char name[48];
    for (int c = 0; c < 2; c++) {
        snprintf(name, sizeof name, "%s [Msun]", mass[c]);
        sink->add(sink, name, one * x->sum[c] * x->suns);
        snprintf(name, sizeof name, "%s_rate [Msun yr^-1]", mass[c]);
        sink->add(sink, name, span > 0 ? one * (x->sum[c] - x->told[c]) * x->suns / span : 0);
    }
    for (int c = 0; c < 3; c++) {
        snprintf(name, sizeof name, "%s [1]", number[c]);
        sink->add(sink, name, one * x->sum[DISSOLVED + c]);
    }
    sink->add(sink, "condensation_cut [Msun]", one * x->sum[CUT] * x->suns);
    sink->add(sink, "drag_heat [erg]", one * x->heat * units_cgs(&sim->units, "energy"));
    if (!isnan(x->transition)) sink->add(sink, "gas_to_clouds [Msun]", one * x->formed * x->suns);
    memcpy(x->told, x->sum, sizeof x->told);
    x->at = now;
}

const struct module exchange_module = {
    .name = "exchange", .whole = true, .doc = "drag, condensation and evaporation between clouds and gas", .kind = MODULE_BLOCK,
    .params = params, .requires = requires, .state_bytes = sizeof(struct exchange), .saved = saved, .declare = declare,
    .begin = begin, .end = end, .energy = energy, .budget = budget, .hook = {[HOOK_EVENT] = event, [HOOK_LIMIT] = limit},
};
