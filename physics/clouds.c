/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `clouds`: cold clouds as sticky particles (doc/manual/clouds.md). Those that meet within a step bounce and
 * lose part of their relative motion, or, if they are bound to each other, become one; or viscosity slows overlapping
 * ones. */
#include "clouds.h"
#include "comm.h"
#include "constants.h"
#include "gravity/contact.h"
#include "log.h"
#include "meetings.h"
#include "mem.h"
#include "module.h"
#include "partners.h"
#include "ranks.h"
#include <math.h>
#include <stdlib.h>

enum variant { STICKY, VISCOUS };
enum coagulation { BOUND, ALWAYS, NEVER };
enum tally { COLLISIONS, COAGULATIONS, POSTPONED, N_TALLIES };

struct clouds {
    /* Parameters. */
    int variant, coagulation;
    struct cloud_size size;
    double restitution, most, crossing, rest;
    struct viscosity viscosity;
    /* State. */
    double years;                           /* code unit of time */
    double radiated, bound;                 /* kinetic energy lost; fall of the potential energy where pairs became one */
    double untold;                          /* of that, by this step's, what the potentials of other rows do not know yet */
    double spin[3];                         /* angular momentum about their centres of pairs that became one */
    int64_t count[N_TALLIES], told[N_TALLIES];
    double at;                              /* time of the last row of budget.csv */
    float *speed;                           /* of rows whose step ends: largest relative one of a partner */
    int64_t speeds;
    clouds_joined *joined;
};

static const struct param params[] = {
    {"variant", PARAM_CHOICE, "", "sticky", 0, 0, "sticky|viscous",
     "clouds that meet bounce or become one; or overlapping clouds feel an artificial viscosity", true,
     offsetof(struct clouds, variant)},
    {"radius", PARAM_REAL, "length", "50 pc", 1e-300, 1e300, NULL, "of a cloud of 1e6 Msun", false,
     offsetof(struct clouds, size.radius)},
    {"power", PARAM_REAL, "", "0.5", 0, 1, NULL, "of its mass, to which a cloud's radius is proportional", false,
     offsetof(struct clouds, size.power)},
    {"restitution", PARAM_REAL, "", "0.2", 0, 1, NULL,
     "sticky: part of the speed of approach that is left after a bounce, outwards", true, offsetof(struct clouds, restitution)},
    {"coagulation", PARAM_CHOICE, "", "bound", 0, 0, "bound|always|never", "sticky: which clouds that meet become one", true,
     offsetof(struct clouds, coagulation)},
    {"most", PARAM_REAL, "mass", "1e7 Msun", 1e-300, 1e300, NULL, "sticky: no coagulation above this mass", true,
     offsetof(struct clouds, most)},
    {"rest", PARAM_REAL, "", "0", 0, 1000, NULL,
     "sticky: after a bounce a cloud passes through others for this many crossing times sqrt(h^3/(G m))",
     false, offsetof(struct clouds, rest)},
    {"alpha", PARAM_REAL, "", "1", 0, 100, NULL, "viscous: linear term", true, offsetof(struct clouds, viscosity.alpha)},
    {"beta", PARAM_REAL, "", "2", 0, 100, NULL, "viscous: quadratic term", true, offsetof(struct clouds, viscosity.beta)},
    {"sound", PARAM_REAL, "velocity", "7 km/s", 0, 1e300, NULL, "viscous: speed of sound among clouds", true,
     offsetof(struct clouds, viscosity.sound)},
    {"crossing", PARAM_REAL, "", "4", 1e-3, 1000, NULL,
     "longest step: way of a cloud against the fastest one near, in diameters", true, offsetof(struct clouds, crossing)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct clouds, field), sizeof((struct clouds *)0)->field}
static const struct saved saved[] = {SAVED(radiated), SAVED(bound), SAVED(spin), SAVED(count), SAVED(told), SAVED(at), {0}};
#undef SAVED

double clouds_radius(const struct sim *sim, double mass)
{
    const struct clouds *clouds = sim_state(sim, "clouds");
    return cloud_radius(&clouds->size, mass);
}

void clouds_when_joined(struct sim *sim, clouds_joined *joined)
{
    ((struct clouds *)sim_state(sim, "clouds"))->joined = joined;
}

static void declare(struct sim *sim, void *state)
{
    struct clouds *clouds = state;
    sim->species[CLOUD].shrinks = true;
    tree_need(&sim->tree, NODE_cloud_radius, 1);
    if (clouds->rest > 0) species_need(&sim->species[CLOUD], COLUMN_rested);
    clouds->size.suns = sim->units.mass / CONST_M_SUN;
    if (!sim->units.physical) problems_add(&sim->problems, "clouds needs physical units: this scene is dimensionless");
}

static void begin(struct sim *sim, void *state)
{
    struct clouds *clouds = state;
    clouds->years = units_cgs(&sim->units, "time") / CONST_YEAR;
    if (sim->time.tick == 0) clouds->at = timeline_now(&sim->time);
}

static void end(struct sim *sim, void *state)
{
    (void)sim;
    mem_free(((struct clouds *)state)->speed);
}

/* --- what comes of it --- */

struct context { struct sim *sim; struct clouds *clouds; struct partners *all; };

/* Where b's image is. */
static void image(const struct party *b, const double shift[3], double pos[3])
{
    for (int k = 0; k < 3; k++) pos[k] = b->body.pos[k] + shift[k];
}

/* By how much the potential energy rises when two become one at their centre of mass: their own attraction is gone, and in
 * the field of all others they lie elsewhere, on the mean deeper (the mean of a potential over a sphere is not that of its
 * middle). */
static double rise_of_merger(const struct context *c, const struct party *a, const struct party *b, const double shift[3],
                             double *others)
{
    const double m = a->body.mass, n = b->body.mass;
    struct gravity_piece piece[3] = {{CLOUD, -m, {0}}, {CLOUD, -n, {0}}, {CLOUD, m + n, {0}}};
    double r2 = 0;
    image(a, (const double[3]){0}, piece[0].pos);
    image(b, shift, piece[1].pos);
    for (int k = 0; k < 3; k++) {
        double r = piece[1].pos[k] - piece[0].pos[k];
        piece[2].pos[k] = piece[0].pos[k] + n / (m + n) * r;
        r2 += r * r;
    }
    *others = gravity_field(c->sim, piece, 3, CLOUD, (const int64_t[2]){a->row, b->row});
    return *others - m * n * gravity_pair(c->sim, CLOUD, CLOUD, sqrt(r2));
}

/* The kept row takes elements and potential. What of the change of potential energy the other rows' potentials,
 * known since FORCE, do not tell yet is half of that in their field. */
static void absorb(const struct context *c, const struct party *kept, const struct party *taken, const double shift[3])
{
    struct species *cloud = &c->sim->species[CLOUD];
    const double a = kept->body.mass, b = taken->body.mass;
    const int32_t i = kept->row, j = taken->row;
    double others, rise = rise_of_merger(c, kept, taken, shift, &others), own = rise - others;
    c->clouds->bound -= rise;
    c->clouds->untold += 0.5 * others;
    if (cloud->pot)
        cloud->pot[i] = (float)((a * (double)cloud->pot[i] + b * (double)cloud->pot[j] + 2 * own + others) / (a + b));
    for (int e = FIRST_ELEMENT; e < END_ELEMENTS; e++) {
        double *element = species_column(cloud, (enum column)e);
        if (element) element[i] += element[j];
    }
    if (c->clouds->joined) c->clouds->joined(c->sim, i, j);
    cloud->mass[i] = a + b;     /* at once: for those that meet later in this step */
    cloud->mass[j] = 0;
}

/* Kept is a row whose step ends now, so that its state is of now; of two such the heavier one, of equal ones the lower id. */
static bool keeps(const struct party *a, const struct party *b)
{
    if (isinf(a->span) != isinf(b->span)) return isinf(b->span);
    return a->body.mass != b->body.mass ? a->body.mass > b->body.mass : a->id < b->id;
}

static void coagulate(const struct context *c, struct party *a, struct party *b, const double shift[3])
{
    const double back[3] = {-shift[0], -shift[1], -shift[2]};
    bool first = keeps(a, b);
    struct party *kept = first ? a : b, *taken = first ? b : a;
    struct clouds *clouds = c->clouds;
    absorb(c, kept, taken, first ? shift : back);
    clouds->radiated += collide_merge(&kept->body, &taken->body, first ? shift : back, clouds->spin);
    kept->body.radius = cloud_radius(&clouds->size, kept->body.mass);
    taken->joined = (int32_t)(kept - c->all->party);
    clouds->count[COAGULATIONS]++;
}

/* A bounce lasts as long as it takes to cross a cloud: until then it meets nobody else. */
static void rest(const struct context *c, struct party *party, double time)
{
    const struct body *body = &party->body;
    if (c->clouds->rest > 0)
        party->rested = time + c->clouds->rest * sqrt(pow(body->radius, 3) / (c->sim->units.G * body->mass));
}

/* Pairs that are bound but would be too heavy as one bounce without loss, unless clouds rest after a bounce: with one they would
 * come to rest on each other and bounce endlessly. */
static bool meet(void *data, struct party *a, struct party *b, const double shift[3], double time)
{
    const struct context *c = data;
    struct clouds *clouds = c->clouds;
    bool small = a->body.mass + b->body.mass <= clouds->most, can = !(isinf(a->span) && isinf(b->span));
    bool sticks = clouds->coagulation == ALWAYS ||
                  (clouds->coagulation == BOUND && collide_bound(c->sim->units.G, &a->body, &b->body));
    const double left = sticks && !small && !(clouds->rest > 0) ? 1 : clouds->restitution;
    if (sticks && small && can) {
        coagulate(c, a, b, shift);
    } else {
        if (time < a->rested || time < b->rested) return false;
        if (!collide_bounce(&a->body, &b->body, shift, left, time, &clouds->radiated)) return false;
        rest(c, a, time);
        rest(c, b, time);
    }
    clouds->count[COLLISIONS]++;
    return true;
}

static int by_ids(const void *x, const void *y)
{
    const uint64_t *p = x, *q = y;
    return p[0] != q[0] ? (p[0] > q[0]) - (p[0] < q[0]) : (p[1] > q[1]) - (p[1] < q[1]);
}

/* Couple after couple in the order of their ids. */
static void rub(const struct context *c)
{
    struct partners *all = c->all;
    uint64_t (*order)[3] = mem_alloc("clouds", (size_t)all->couples * sizeof *order);
    for (int64_t k = 0; k < all->couples; k++) {
        uint64_t a = all->party[all->couple[k].a].id, b = all->party[all->couple[k].b].id;
        order[k][0] = a < b ? a : b;
        order[k][1] = a < b ? b : a;
        order[k][2] = (uint64_t)k;
    }
    if (all->couples > 0) qsort(order, (size_t)all->couples, sizeof *order, by_ids);
    for (int64_t k = 0; k < all->couples; k++) {
        const struct couple *couple = &all->couple[order[k][2]];
        struct party *a = &all->party[couple->a], *b = &all->party[couple->b];
        double lost = collide_rub(&a->body, &b->body, couple->shift, &c->clouds->viscosity, fmin(a->span, b->span));
        if (!(lost > 0)) continue;
        a->version++;
        b->version++;
        c->clouds->radiated += lost;
    }
    mem_free(order);
}

static int ascending(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

/* The rows become what their parties are now; one in the midst of its step so that its state now is that. */
static void write_back(const struct context *c)
{
    struct sim *sim = c->sim;
    struct species *cloud = &sim->species[CLOUD];
    int32_t *sleeping = mem_array("clouds", int32_t, c->all->n), asleep = 0;
    for (int32_t p = 0; p < c->all->n; p++) {
        const struct party *party = &c->all->party[p];
        if (party->version == 0 || party->joined >= 0) continue;
        struct body old = partners_body(sim, &c->clouds->size, party->row);
        double lag = timeline_lag(&sim->time, cloud->rung[party->row], cloud->rung0[party->row]);
        for (int k = 0; k < 3; k++) {
            double change = party->body.vel[k] - old.vel[k];
            cloud->vel[party->row][k] += change;
            cloud->pos[party->row][k] += party->body.pos[k] - old.pos[k] - lag * change;
        }
        for (int k = 0; k < 3; k++) cloud->acc[party->row][k] = (float)party->body.acc[k];
        cloud->mass[party->row] = party->body.mass;
        if (cloud->rested) cloud->rested[party->row] = timeline_now(&sim->time) + party->rested;
        if (isinf(party->span)) sleeping[asleep++] = party->row;
    }
    for (int32_t p = 0; p < c->all->n; p++)
        if (c->all->party[p].joined >= 0) ranks_remove(sim, CLOUD, c->all->party[p].row);
    if (asleep > 0) qsort(sleeping, (size_t)asleep, sizeof *sleeping, ascending);
    tree_follow_rows(sim, CLOUD, sleeping, asleep);
    mem_free(sleeping);
}

/* Only clouds whose step ends grow, from gas before this or from each other. */
static void measure_cells(struct sim *sim, const struct clouds *clouds)
{
    const struct species *cloud = &sim->species[CLOUD];
    const bool all = sim->tree.built == sim->time.tick || cloud->n_ending > cloud->n / 4;
    partners_measure(sim, &clouds->size, all ? NULL : cloud->ending, cloud->n_ending);
}

/* All ranks hold all rows and do the same for the clouds of all. */
static void event(struct sim *sim, void *state)
{
    struct clouds *clouds = state;
    const struct species *cloud = &sim->species[CLOUD];
    struct partners all = {0};
    uint64_t keep = sim->want_potential ? (uint64_t)1 << COLUMN_pot : 0;
    clouds->untold = 0;
    if (cloud->n_ending == 0 && sim->tree.built < sim->time.tick) return;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    measure_cells(sim, clouds);
    if (cloud->n > clouds->speeds) {
        clouds->speed = mem_resize("clouds", clouds->speed, (size_t)cloud->capacity * sizeof *clouds->speed);
        clouds->speeds = cloud->capacity;
    }
    const int64_t joined = clouds->count[COAGULATIONS];
    partners_gather(sim, &clouds->size, clouds->speed, &all);
    struct context context = {sim, clouds, &all};
    const struct meetings_rule rule = {meet, &context};
    if (clouds->variant == STICKY) clouds->count[POSTPONED] += meetings_run(all.party, all.n, all.couple, all.couples, &rule);
    else rub(&context);
    write_back(&context);
    if (clouds->count[COAGULATIONS] > joined) measure_cells(sim, clouds);
    partners_free(&all);
}

/* Way within a step: of pairs only the nearest images meet, so that in a box it stays well below half a side. */
static double longest_way(const struct sim *sim, const struct clouds *clouds, double mass)
{
    double way = clouds->crossing * 2 * cloud_radius(&clouds->size, mass);
    for (int k = 0; k < 3; k++)
        if (sim->box.side[k] > 0) way = fmin(way, 0.25 * sim->box.side[k]);
    return way;
}

/* Without partners twice the step before, and at the start what the motion against the centre of mass of all allows: so
 * that the search for partners does not jump to the whole of the model. */
static double longest(const struct sim *sim, const struct clouds *clouds, int64_t i)
{
    const struct species *cloud = &sim->species[CLOUD];
    double way = longest_way(sim, clouds, cloud->mass[i]), step = timeline_step(&sim->time, cloud->rung0[i]);
    double speed = (double)clouds->speed[i], v2 = 0;
    for (int k = 0; k < 3 && sim->tree.n_nodes > 0; k++) v2 += pow(cloud->vel[i][k] - (double)sim->tree.node[0].vel[k], 2);
    return fmin(way / speed, step > 0 ? 2 * step : way / sqrt(v2));
}

static void limit(struct sim *sim, void *state)
{
    const struct clouds *clouds = state;
    struct species *cloud = &sim->species[CLOUD];
    for (int64_t a = 0; a < cloud->n_active; a++) {
        int64_t i = cloud->active[a];
        if (!species_gone(cloud, i)) cloud->dt[i] = fminf(cloud->dt[i], (float)longest(sim, clouds, i));
    }
}

static void reason(const struct sim *sim, const void *state, const struct species *table, int64_t row, struct step_reason *step)
{
    const struct clouds *clouds = state;
    if (table->kind != CLOUD || row >= clouds->speeds || species_gone(table, row)) return;
    double dt = longest(sim, clouds, row);
    if (dt < step->dt) *step = (struct step_reason){dt, "clouds.crossing"};
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct clouds *clouds = state;
    const double one = comm_rank() == 0;
    sink->add(sink, "radiated_clouds", one * clouds->radiated);
    if (sim_state(sim, "gravity")) sink->add(sink, "booked_clouds_bound", one * (clouds->bound + clouds->untold));
}

/* Rates are the means since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct clouds *clouds = state;
    const struct species *cloud = &sim->species[CLOUD];
    static const char *const names[N_TALLIES] = {"collisions", "coagulations", "postponed"};
    const double one = comm_rank() == 0, now = timeline_now(&sim->time), span = (now - clouds->at) * clouds->years;
    double live = 0, heaviest = 0;
    char name[48];
    for (int64_t i = cloud->own; i < cloud->own + cloud->n_own; i++) live += !species_gone(cloud, i);
    for (int64_t i = 0; i < cloud->n; i++) heaviest = fmax(heaviest, cloud->mass[i]);
    sink->add(sink, "clouds [1]", live);
    sink->add(sink, "heaviest_cloud [Msun]", one * heaviest * clouds->size.suns);
    for (int c = 0; c < N_TALLIES; c++) {
        snprintf(name, sizeof name, "cloud_%s [1]", names[c]);
        sink->add(sink, name, one * (double)clouds->count[c]);
        snprintf(name, sizeof name, "cloud_%s_rate [yr^-1]", names[c]);
        if (c != POSTPONED) sink->add(sink, name, span > 0 ? one * (double)(clouds->count[c] - clouds->told[c]) / span : 0);
        clouds->told[c] = clouds->count[c];
    }
    clouds->at = now;
    for (int k = 0; k < 3; k++) {
        snprintf(name, sizeof name, "cloud_spin_%c [Msun kpc km s^-1]", 'x' + k);
        const double unit = clouds->size.suns * sim->units.length / (1e3 * CONST_PC) * sim->units.velocity / 1e5;
        sink->add(sink, name, one * clouds->spin[k] * unit);
    }
}

/* Part of a box that its clouds fill, above which the free path is shorter than a cloud. */
static const double crowded = 0.1;

static void warn(struct sim *sim, void *state)
{
    const struct clouds *clouds = state;
    const struct species *cloud = &sim->species[CLOUD];
    double filled = 0, volume = sim->box.side[0] * sim->box.side[1] * sim->box.side[2];
    for (int64_t i = 0; i < cloud->n; i++) filled += 4 * acos(-1) / 3 * pow(cloud_radius(&clouds->size, cloud->mass[i]), 3);
    if (volume > 0 && filled > crowded * volume)
        log_warning("clouds fill %.2g of the box: their free path is shorter than they are", filled / volume);
}

const struct module clouds_module = {
    .name = "clouds", .whole = true, .doc = "cold clouds as sticky particles", .kind = MODULE_BLOCK, .params = params,
    .state_bytes = sizeof(struct clouds), .saved = saved, .declare = declare, .begin = begin, .end = end, .energy = energy,
    .budget = budget, .reason = reason, .warn = warn, .hook = {[HOOK_EVENT] = event, [HOOK_LIMIT] = limit},
};
