/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `cloud_stars`: stars form in cold clouds, when a clock has run out or two clouds have become one, and what is left of
 * the cloud flies apart in fragments (doc/manual/cloud-stars.md). */
#include "clouds.h"
#include "comm.h"
#include "constants.h"
#include "gravity/contact.h"
#include "mem.h"
#include "module.h"
#include "random.h"
#include "ranks.h"
#include <math.h>
#include <string.h>

enum trigger { CLOCK, COLLISION };
enum { FRAGMENTS = 4, PRODUCTS = 1 + FRAGMENTS };
enum tally { BIRTHS, TOO_LIGHT, N_TALLIES };

struct cloud_stars {
    /* Parameters. */
    int trigger;
    double wait, heavy, colliding, coupling, yield, most, constant, least, speed;
    /* State. */
    double formed, told, at;                /* mass of all stars formed, and at the last row of budget.csv with its time */
    double injected, bound, untold;         /* kinetic energy of fragments; fall of the potential energy; half-known part of it */
    double count[N_TALLIES], counted;
};

static const struct param params[] = {
    {"trigger", PARAM_CHOICE, "", "clock", 0, 0, "clock|collision",
     "stars form in a cloud every `wait`; or a free-fall time after clouds have become one of more than `colliding`", false,
     offsetof(struct cloud_stars, trigger)},
    {"wait", PARAM_REAL, "time", "200 Myr", 1e-300, 1e300, NULL, "clock: time in which a cloud forms no stars", true,
     offsetof(struct cloud_stars, wait)},
    {"heavy", PARAM_REAL, "mass", "none", 0, 1e300, NULL,
     "clock: clouds that become heavier form stars a free-fall time later, whatever their clock says; default: none", true,
     offsetof(struct cloud_stars, heavy)},
    {"colliding", PARAM_REAL, "mass", "1e5 Msun", 0, 1e300, NULL, "collision: least mass of what two clouds become", true,
     offsetof(struct cloud_stars, colliding)},
    {"efficiency", PARAM_REAL, "", "none", 1e-6, 0.99, NULL,
     "part of a cloud that becomes stars; default: as much as unbinds it, of its mass", true,
     offsetof(struct cloud_stars, constant)},
    {"coupling", PARAM_REAL, "", "2e-3", 1e-9, 1, NULL, "part of the supernovae's energy that unbinds their cloud", true,
     offsetof(struct cloud_stars, coupling)},
    {"yield", PARAM_REAL, "specific_energy", "2.5e5 km^2/s^2", 1e-300, 1e300, NULL, "energy of the supernovae II of a mass of stars",
     true, offsetof(struct cloud_stars, yield)},
    {"most", PARAM_REAL, "", "0.4", 1e-6, 0.99, NULL, "largest part of a cloud that becomes stars at once", true,
     offsetof(struct cloud_stars, most)},
    {"least", PARAM_REAL, "mass", "1e3 Msun", 0, 1e300, NULL, "stars of less mass do not form: the cloud waits again", true,
     offsetof(struct cloud_stars, least)},
    {"speed", PARAM_REAL, "velocity", "10 km/s", 0, 1e300, NULL, "of the four fragments, outwards", true,
     offsetof(struct cloud_stars, speed)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct cloud_stars, field), sizeof((struct cloud_stars *)0)->field}
static const struct saved saved[] = {SAVED(formed), SAVED(told), SAVED(at), SAVED(injected), SAVED(bound), SAVED(count),
                                     SAVED(counted), {0}};
#undef SAVED

static const char *const requires[] = {"clouds", NULL};

/* Whether the scene gives a key another value than its default. */
static bool differs(const struct sim *sim, const char *key, double value)
{
    const struct param *param = params;
    double fallback = NAN;
    while (strcmp(param->name, key) != 0) param++;
    if (strcmp(param->fallback, "none") == 0) return !isnan(value);
    mem_free(units_parse(&sim->units, param->fallback, param->unit, &fallback));
    return fabs(value - fallback) > 1e-9 * fabs(fallback);
}

/* Keys that do nothing beside others. */
static void check_meaning(struct sim *sim, const struct cloud_stars *cs)
{
    const bool clock = cs->trigger == CLOCK, own = isnan(cs->constant);
    const struct { const char *key; double value; bool means; const char *needs; } table[] = {
        {"wait", cs->wait, clock, "trigger: clock"}, {"heavy", cs->heavy, clock, "trigger: clock"},
        {"colliding", cs->colliding, !clock, "trigger: collision"}, {"coupling", cs->coupling, own, "no efficiency"},
        {"yield", cs->yield, own, "no efficiency"}, {"most", cs->most, own, "no efficiency"}};
    for (size_t k = 0; k < sizeof table / sizeof *table; k++)
        if (!table[k].means && differs(sim, table[k].key, table[k].value))
            problems_add(&sim->problems, "%s: cloud_stars.%s has a meaning only with %s",
                         scene_place(sim->scene, "cloud_stars", table[k].key), table[k].key, table[k].needs);
}

static void declare(struct sim *sim, void *state)
{
    static const enum column of_stars[] = {COLUMN_birth, COLUMN_mass_born, COLUMN_age_paid};
    struct species *cloud = &sim->species[CLOUD], *star = &sim->species[STAR];
    check_meaning(sim, state);
    for (int c = 0; c < 3; c++) species_need(star, of_stars[c]);
    if (sim_state(sim, "feedback")) species_need(star, COLUMN_advance);
    species_need(cloud, COLUMN_ready);
    species_need(cloud, COLUMN_children);
    star->grows = cloud->grows = true;
}

/* --- clocks --- */

static double free_fall_time(const struct sim *sim, double mass)
{
    const double pi = acos(-1), rho = mass / (4 * pi / 3 * pow(clouds_radius(sim, mass), 3));
    return sqrt(3 * pi / (32 * sim->units.G * rho));
}

/* When a cloud that has just been born, or has just formed stars, forms the next ones. */
static double next_time(const struct sim *sim, const struct cloud_stars *cs)
{
    return cs->trigger == CLOCK ? timeline_now(&sim->time) + cs->wait : INFINITY;
}

/* Clouds that gas has become since (0) start their wait now. */
static double ready_of(const struct sim *sim, const struct cloud_stars *cs, int64_t i)
{
    double ready = sim->species[CLOUD].ready[i];
    return ready == 0 ? next_time(sim, cs) : ready;
}

/* Clocks: the mean of both, by mass. Collisions: a free-fall time from now, or when one of the two is due. */
static void joined(struct sim *sim, int32_t kept, int32_t taken)
{
    const struct cloud_stars *cs = sim_state(sim, "cloud_stars");
    const struct species *cloud = &sim->species[CLOUD];
    const double a = cloud->mass[kept], b = cloud->mass[taken], first = ready_of(sim, cs, kept), second = ready_of(sim, cs, taken);
    double *ready = &cloud->ready[kept];
    if (cs->trigger == CLOCK) *ready = (a * first + b * second) / (a + b);
    else *ready = fmin(first, second);
    if (a > cs->heavy) *ready = fmin(*ready, first);
    if (b > cs->heavy) *ready = fmin(*ready, second);
    if (cs->trigger == COLLISION && a + b >= cs->colliding)
        *ready = fmin(*ready, timeline_now(&sim->time) + free_fall_time(sim, a + b));
}

/* Clocks start at random places, so that a run does not begin with a burst. */
static void begin(struct sim *sim, void *state)
{
    struct cloud_stars *cs = state;
    const struct species *cloud = &sim->species[CLOUD];
    clouds_when_joined(sim, joined);
    if (sim_state(sim, "gravity") && gravity_contact(sim, CLOUD, STAR) == 0)
        fail(STATUS_INPUT, "cloud_stars: stars begin in the middle of their cloud: gravity.softening must be above 0");
    if (sim->time.tick > 0 || sim->started) return;
    cs->at = timeline_now(&sim->time);
    for (int64_t i = 0; i < cloud->n; i++) {
        const struct random key = {sim->seed, cloud->id[i], 0, random_stream("cloud_stars")};
        cloud->ready[i] = next_time(sim, cs) - (cs->trigger == CLOCK ? cs->wait * random_uniform(&key, 0) : 0);
    }
}

/* --- births --- */

/* eps f_c e m = 3/5 G m^2/h: the stars form until their energy has unbound the cloud. */
static double part_of_stars(const struct sim *sim, const struct cloud_stars *cs, double mass)
{
    const double depth = 0.6 * sim->units.G * mass / clouds_radius(sim, mass);
    return isnan(cs->constant) ? fmin(cs->most, depth / (cs->coupling * cs->yield)) : cs->constant;
}

/* Corners of a regular tetrahedron about its centre, turned at random. */
static void draw_corners(const struct random *key, double corner[FRAGMENTS][3])
{
    static const double sign[FRAGMENTS][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    double x[3], y[3], z[3], other[3], along = 0, length = 0;
    random_direction(key, 0, x);
    random_direction(key, 1, other);
    for (int k = 0; k < 3; k++) along += x[k] * other[k];
    for (int k = 0; k < 3; k++) y[k] = other[k] - along * x[k];
    for (int k = 0; k < 3; k++) length += y[k] * y[k];
    for (int k = 0; k < 3; k++) y[k] /= sqrt(length);
    for (int k = 0; k < 3; k++) z[k] = x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3];
    for (int f = 0; f < FRAGMENTS; f++)
        for (int k = 0; k < 3; k++) corner[f][k] = (sign[f][0] * x[k] + sign[f][1] * y[k] + sign[f][2] * z[k]) / sqrt(3);
}

/* The rise of the potential energy: of the products in the field of all others, and of their own attraction, which the cloud as
 * one row did not have. */
static double potential_rise(const struct sim *sim, int64_t row, const struct gravity_piece piece[PRODUCTS + 1], double *others)
{
    double own = 0;
    *others = gravity_field(sim, piece, PRODUCTS + 1, CLOUD, (const int64_t[2]){row, -1});
    for (int a = 1; a < PRODUCTS + 1; a++)
        for (int b = 1; b < a; b++) {
            double r2 = 0;
            for (int k = 0; k < 3; k++) r2 += pow(piece[a].pos[k] - piece[b].pos[k], 2);
            own += piece[a].mass * piece[b].mass * gravity_pair(sim, piece[a].kind, piece[b].kind, sqrt(r2));
        }
    return own + *others;
}

/* Elements of a new row, which takes the part `part` of what the cloud has. */
static void share_elements(const struct sim *sim, enum species_kind kind, int64_t to, int64_t from, double part)
{
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
        double *target = species_column(&sim->species[kind], (enum column)c);
        const double *source = species_column(&sim->species[CLOUD], (enum column)c);
        if (target && source) target[to] = part * source[from];
    }
}

static void make_star(struct sim *sim, int64_t row, double mass, double advance)
{
    const int64_t to = ranks_append(sim, STAR, 1);
    struct species *star = &sim->species[STAR], *cloud = &sim->species[CLOUD];
    const int rung = timeline_rung(&sim->time, timeline_seconds(&sim->time, (int64_t)1 << cloud->rung[row]));
    memcpy(star->pos[to], cloud->pos[row], sizeof star->pos[to]);
    memcpy(star->vel[to], cloud->vel[row], sizeof star->vel[to]);
    memcpy(star->acc[to], cloud->acc[row], sizeof star->acc[to]);
    star->rung[to] = star->rung0[to] = (uint8_t)(rung > 0 ? rung : 0);
    star->id[to] = species_heir(cloud->id[row], ++cloud->children[row]);
    star->mass[to] = star->mass_born[to] = mass;
    star->birth[to] = timeline_now(&sim->time);
    if (star->advance) star->advance[to] = advance;
    if (star->pot) star->pot[to] = cloud->pot[row];
    share_elements(sim, STAR, to, row, mass / cloud->mass[row]);
}

/* The cloud itself becomes the first fragment, which keeps its id, or, where its children would not be told apart any more, takes
 * that of a child. */
static void fly_apart(struct sim *sim, const struct cloud_stars *cs, int64_t row, const struct gravity_piece *fragment,
                      const double corner[FRAGMENTS][3])
{
    const int64_t first = ranks_append(sim, CLOUD, FRAGMENTS - 1);
    struct species *cloud = &sim->species[CLOUD];
    const double part = fragment->mass / cloud->mass[row];
    if (cloud->rested) cloud->rested[row] = -INFINITY;
    share_elements(sim, CLOUD, row, row, part);
    cloud->ready[row] = next_time(sim, cs);
    for (int f = FRAGMENTS - 1; f >= 0; f--) {
        const int64_t to = f == 0 ? row : first + f - 1;
        for (int c = 0; c < N_COLUMNS && f > 0; c++) {
            char *column = species_column(cloud, (enum column)c);
            const size_t bytes = species_row_bytes((enum column)c);
            if (column) memcpy(column + (size_t)to * bytes, column + (size_t)row * bytes, bytes);
        }
        if (f > 0) {
            cloud->id[to] = species_heir(cloud->id[row], ++cloud->children[row]);
            cloud->children[to] = 0;
        }
        cloud->mass[to] = fragment[f].mass;
        memcpy(cloud->pos[to], fragment[f].pos, sizeof cloud->pos[to]);
        for (int k = 0; k < 3; k++) cloud->vel[to][k] += cs->speed * corner[f][k];
    }
    if (cloud->children[row] > UINT8_MAX - PRODUCTS) {
        cloud->id[row] = species_heir(cloud->id[row], ++cloud->children[row]);
        cloud->children[row] = 0;
    }
}

static void give_birth(struct sim *sim, struct cloud_stars *cs, int64_t row, double mass)
{
    const struct species *cloud = &sim->species[CLOUD];
    const struct random key = {sim->seed, cloud->id[row], (uint64_t)sim->time.tick, random_stream("fragments")};
    const double whole = cloud->mass[row], left = whole - mass, h = clouds_radius(sim, whole);
    double corner[FRAGMENTS][3], others;
    struct gravity_piece piece[PRODUCTS + 1] = {{CLOUD, -whole, {0}}, {STAR, mass, {0}}};
    draw_corners(&key, corner);
    for (int f = 0; f < FRAGMENTS; f++) piece[2 + f] = (struct gravity_piece){CLOUD, left / FRAGMENTS, {0}};
    for (int p = 0; p < PRODUCTS + 1; p++)
        for (int k = 0; k < 3; k++) piece[p].pos[k] = cloud->pos[row][k] + (p > 1 ? h * corner[p - 2][k] : 0);
    const double rise = potential_rise(sim, row, piece, &others), motion = 0.5 * left * cs->speed * cs->speed;
    make_star(sim, row, mass, motion);
    fly_apart(sim, cs, row, piece + 2, corner);
    cs->injected += motion;
    cs->bound -= rise;
    cs->untold += rise;     /* the potentials of this step know nothing of it */
    cs->formed += mass;
    cs->count[BIRTHS]++;
}

/* All ranks hold all rows and do the same for the clouds of all, one after the other in row order. */
static void event(struct sim *sim, void *state)
{
    struct cloud_stars *cs = state;
    const struct species *cloud = &sim->species[CLOUD];
    const double now = timeline_now(&sim->time);
    uint64_t keep = sim->want_potential ? (uint64_t)1 << COLUMN_pot : 0;
    cs->untold = 0;
    if (cloud->n_ending == 0) return;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    for (int64_t e = 0; e < cloud->n_ending; e++) {
        const int64_t i = cloud->ending[e];
        if (species_gone(cloud, i)) continue;
        cloud->ready[i] = ready_of(sim, cs, i);
        if (cloud->mass[i] > cs->heavy) cloud->ready[i] = fmin(cloud->ready[i], now + free_fall_time(sim, cloud->mass[i]));
        if (cloud->ready[i] > now) continue;
        const double mass = part_of_stars(sim, cs, cloud->mass[i]) * cloud->mass[i];
        if (mass >= cs->least) {
            give_birth(sim, cs, i, mass);
        } else {
            cloud->ready[i] = next_time(sim, cs);
            cs->count[TOO_LIGHT]++;
        }
    }
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct cloud_stars *cs = state;
    const double one = comm_rank() == 0;
    sink->add(sink, "injected_fragments", -one * cs->injected);
    if (sim_state(sim, "gravity")) sink->add(sink, "booked_fragments_bound", one * (cs->bound + cs->untold));
}

/* Rates are the means since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct cloud_stars *cs = state;
    const double one = comm_rank() == 0, sun = sim->units.mass / CONST_M_SUN, year = units_cgs(&sim->units, "time") / CONST_YEAR;
    const double now = timeline_now(&sim->time), span = (now - cs->at) * year;
    sink->add(sink, "cloud_sfr [Msun yr^-1]", span > 0 ? one * (cs->formed - cs->told) * sun / span : 0);
    sink->add(sink, "cloud_stars [Msun]", one * cs->formed * sun);
    sink->add(sink, "cloud_births [1]", one * cs->count[BIRTHS]);
    sink->add(sink, "cloud_births_rate [yr^-1]", span > 0 ? one * (cs->count[BIRTHS] - cs->counted) / span : 0);
    sink->add(sink, "cloud_births_too_light [1]", one * cs->count[TOO_LIGHT]);
    cs->told = cs->formed;
    cs->counted = cs->count[BIRTHS];
    cs->at = now;
}

const struct module cloud_stars_module = {
    .name = "cloud_stars", .whole = true, .doc = "stars form in cold clouds", .kind = MODULE_BLOCK, .params = params,
    .requires = requires, .state_bytes = sizeof(struct cloud_stars), .saved = saved, .declare = declare, .begin = begin,
    .energy = energy,
    .budget = budget, .hook = {[HOOK_EVENT] = event},
};
