/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `sinks`: gas that falls together beyond what the rows resolve becomes one row, which swallows what falls
 * on it (Bate, Bonnell & Price 1995, MNRAS 277, 362; doc/manual/sinks.md). A sink is a star row that is marked by the
 * column `sink`; what it has taken in of angular momentum about its centre is its `spin`. */
#include "comm.h"
#include "gravity/contact.h"
#include "file/layout.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include "sph/sph.h"
#include "steps.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct sinks {
    /* Parameters. */
    double density, radius, inner, time_step;
    /* State. */
    double count, mass, told, at;       /* sinks formed, what all have swallowed; at the last row of budget.csv with its time */
    double radiated, heat, bound;       /* kinetic and thermal energy that went with it; fall of the potential energy */
    double untold;                      /* of that, by this step's, what the potentials of other rows do not know yet */
};

static const struct param params[] = {
    {"density", PARAM_REAL, "density", NULL, 1e-300, 1e300, NULL, "gas denser than this may become a sink", true,
     offsetof(struct sinks, density)},
    {"radius", PARAM_REAL, "length", NULL, 1e-300, 1e300, NULL, "within which a sink is made, and swallows gas that is bound to it",
     true, offsetof(struct sinks, radius)},
    {"inner", PARAM_REAL, "", "0.1", 0, 1, NULL, "part of the radius within which a sink swallows whatever comes", true,
     offsetof(struct sinks, inner)},
    {"time_step", PARAM_REAL, "", "0.1", 1e-4, 10, NULL, "eta of a sink's longest step eta sqrt(radius^3/(G m))", true,
     offsetof(struct sinks, time_step)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct sinks, field), sizeof(double)}
static const struct saved saved[] = {
    SAVED(count), SAVED(mass), SAVED(told), SAVED(at), SAVED(radiated), SAVED(heat), SAVED(bound), {0}};
#undef SAVED

static const char *const needed[] = {"sph", "gravity", NULL};

static void declare(struct sim *sim, void *state)
{
    (void)state;
    const enum column of_sinks[] = {COLUMN_sink, COLUMN_spin, COLUMN_birth};
    for (size_t c = 0; c < sizeof of_sinks / sizeof *of_sinks; c++) species_need(&sim->species[STAR], of_sinks[c]);
    sim->species[STAR].grows = true;
    sim->species[GAS].shrinks = true;
}

static void begin(struct sim *sim, void *state)
{
    struct sinks *sinks = state;
    if (gravity_gas_is_adaptive(sim))
        fail(STATUS_INPUT, "sinks: what a sink's softening costs is known for gas of one softening: gravity.softening_adaptive "
                           "must be off");
    if (sim->time.tick == 0) sinks->at = timeline_now(&sim->time);
}

static void warn(struct sim *sim, void *state)
{
    const struct sinks *sinks = state;
    const struct sph *sph = sim_state(sim, "sph");
    const struct species *gas = &sim->species[GAS];
    double mass = 0, within = 4 * acos(-1) / 3 * pow(sinks->radius, 3) * sinks->density;
    for (int64_t i = 0; i < gas->n; i++) mass += gas->mass[i] / (double)gas->n;
    if (within < (double)sph->neighbours * mass)
        log_warning("sinks.radius = %g: at sinks.density it holds %.3g rows, less than a kernel of %lld: what becomes a sink is "
                    "noise", sinks->radius, within / mass, (long long)sph->neighbours);
    if (sph->eos == SPH_BAROTROPIC && sinks->density > sph->stiff_density)
        log_warning("sinks.density is above sph.stiff_density: gas that resists compression hardly falls together; sinks are for "
                    "sph.eos: isothermal");
}

/* --- rows that become one --- */

struct member { struct gravity_piece piece; int64_t row; double vel[3], acc[3], pot, heat; };

/* A row as it is now. */
static struct member member_of(const struct sim *sim, enum species_kind kind, int64_t row)
{
    const struct species *s = &sim->species[kind];
    const double lag = timeline_lag(&sim->time, s->rung[row], s->rung0[row]);
    struct member m = {.piece = {.kind = kind, .mass = s->mass[row]}, .row = row};
    sim_predict(&sim->time, s, row, m.piece.pos);
    for (int k = 0; k < 3; k++) {
        m.acc[k] = (double)s->acc[row][k];
        m.vel[k] = integrate_velocity(s->vel[row][k], m.acc[k], lag);
    }
    m.pot = s->pot ? (double)s->pot[row] : 0;
    m.heat = kind == GAS && s->u ? (double)s->u[row] : 0;
    return m;
}

/* All of them at their centre of mass. pot is the mean of what they had. */
struct whole { struct member one; double spin[3], lost, heat; };

static struct whole unite(const struct member *member, int64_t n)
{
    struct whole w = {.one.piece.kind = STAR};
    for (int64_t m = 0; m < n; m++) w.one.piece.mass += member[m].piece.mass;
    for (int64_t m = 0; m < n; m++) {
        const double part = member[m].piece.mass / w.one.piece.mass;
        for (int k = 0; k < 3; k++) {
            w.one.piece.pos[k] += part * member[m].piece.pos[k];
            w.one.vel[k] += part * member[m].vel[k];
            w.one.acc[k] += part * member[m].acc[k];
        }
        w.one.pot += part * member[m].pot;
    }
    for (int64_t m = 0; m < n; m++) {
        double r[3], v[3];
        for (int k = 0; k < 3; k++) {
            r[k] = member[m].piece.pos[k] - w.one.piece.pos[k];
            v[k] = member[m].vel[k] - w.one.vel[k];
        }
        for (int k = 0; k < 3; k++) {
            const int p = (k + 1) % 3, q = (k + 2) % 3;
            w.spin[k] += member[m].piece.mass * (r[p] * v[q] - r[q] * v[p]);
            w.lost += 0.5 * member[m].piece.mass * v[k] * v[k];
        }
        w.heat += member[m].piece.mass * member[m].heat;
    }
    return w;
}

static double distance2(const double a[3], const double b[3])
{
    return pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2);
}

static struct gravity_piece *pieces_of(const struct member *member, int64_t n)
{
    struct gravity_piece *piece = mem_array("sinks", struct gravity_piece, n + 1);
    for (int64_t m = 0; m < n; m++) piece[m] = member[m].piece;
    return piece;
}

/* By how much the potential energy with all other rows rises when the members become one; `own`: what they had among
 * themselves. gravity_field counts the members as sources too, themselves included: that is taken back. */
static double rise_of(const struct sim *sim, const struct member *member, int64_t n, const struct whole *whole, double *own)
{
    const int64_t without[2] = {-1, -1};
    struct gravity_piece *piece = pieces_of(member, n);
    double others = 0;
    *own = gravity_among(sim, piece, n);
    piece[n] = whole->one.piece;
    for (int64_t m = 0; m < n; m++) {
        const enum species_kind kind = piece[m].kind;
        const double r = sqrt(distance2(piece[m].pos, piece[n].pos));
        others += piece[m].mass * piece[m].mass * gravity_contact(sim, kind, kind);
        others -= piece[m].mass * piece[n].mass * gravity_pair(sim, kind, STAR, r);
        piece[m].mass = -piece[m].mass;
    }
    others += 2 * *own + gravity_field(sim, piece, (int)n + 1, STAR, without);
    mem_free(piece);
    return others;
}

/* The state of a row now becomes the whole's, also in the midst of its step. */
static void set_state(struct sim *sim, int64_t to, const struct whole *whole)
{
    struct species *star = &sim->species[STAR];
    const double lag = timeline_lag(&sim->time, star->rung[to], star->rung0[to]);
    for (int k = 0; k < 3; k++) {
        star->acc[to][k] = (float)whole->one.acc[k];
        const double acc = (double)star->acc[to][k];
        star->vel[to][k] = whole->one.vel[k] - lag * acc;
        star->pos[to][k] = whole->one.piece.pos[k] - lag * (star->vel[to][k] + 0.5 * lag * acc);
        star->spin[to][k] += whole->spin[k];
    }
    star->mass[to] = whole->one.piece.mass;
    if (star->pot) star->pot[to] = (float)whole->one.pot;
}

/* The members become the sink `to`, which is the first of them or a new row. */
static void swallow(struct sim *sim, struct sinks *sinks, const struct member *member, int64_t n, int64_t to)
{
    struct whole whole = unite(member, n);
    double own, others = rise_of(sim, member, n, &whole, &own);
    whole.one.pot += (others - 2 * own) / whole.one.piece.mass;
    set_state(sim, to, &whole);
    for (int64_t m = 0; m < n; m++) {
        if (member[m].piece.kind != GAS) continue;
        for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {
            double *of_gas = species_column(&sim->species[GAS], (enum column)c);
            double *of_sink = species_column(&sim->species[STAR], (enum column)c);
            if (of_gas && of_sink) of_sink[to] += of_gas[member[m].row];
        }
        sinks->mass += member[m].piece.mass;
        ranks_remove(sim, GAS, member[m].row);
    }
    sinks->radiated += whole.lost;
    sinks->heat += whole.heat;
    sinks->bound -= others - own;
    sinks->untold += 0.5 * others;
}

/* --- gas that falls on a sink --- */

/* Energy by mass of a row relative to a sink, if it is swallowed: bound to the mass `within` the radius, with less angular momentum
 * than on a circle there; whatever comes within the inner part. Else 0. */
static double depth_in(const struct sim *sim, const struct sinks *sinks, const struct member *sink, double within,
                       const struct member *gas)
{
    const double r2 = distance2(sink->piece.pos, gas->piece.pos), GM = sim->units.G * within;
    if (!(r2 < sinks->radius * sinks->radius)) return 0;
    double v2 = 0, spin2 = 0, energy = within * gravity_pair(sim, STAR, GAS, sqrt(r2));
    for (int k = 0; k < 3; k++) {
        const int p = (k + 1) % 3, q = (k + 2) % 3;
        v2 += pow(gas->vel[k] - sink->vel[k], 2);
        spin2 += pow((gas->piece.pos[p] - sink->piece.pos[p]) * (gas->vel[q] - sink->vel[q])
                     - (gas->piece.pos[q] - sink->piece.pos[q]) * (gas->vel[p] - sink->vel[p]), 2);
    }
    if (r2 < pow(sinks->inner * sinks->radius, 2)) return energy;
    energy += 0.5 * v2;
    return energy < 0 && spin2 < GM * sinks->radius ? energy : 0;
}

static struct member *list_sinks(const struct sim *sim, int64_t *n)
{
    const struct species *star = &sim->species[STAR];
    struct member *sink = mem_array("sinks", struct member, star->n);
    *n = 0;
    for (int64_t i = 0; i < star->n; i++)
        if (star->sink[i]) sink[(*n)++] = member_of(sim, STAR, i);
    return sink;
}

/* Mass within the radius of each sink, its own and that of gas: what made the gas as fast as it is. */
static double *weigh(const struct sim *sim, const struct sinks *sinks, const struct member *sink, int64_t n)
{
    const struct species *gas = &sim->species[GAS];
    double *within = mem_array("sinks", double, n);
    for (int64_t s = 0; s < n; s++) within[s] = sink[s].piece.mass;
    for (int64_t i = 0; n > 0 && i < gas->n; i++) {
        double pos[3];
        sim_predict(&sim->time, gas, i, pos);
        for (int64_t s = 0; s < n; s++)
            if (distance2(pos, sink[s].piece.pos) < sinks->radius * sinks->radius) within[s] += gas->mass[i];
    }
    return within;
}

/* Each row of gas whose step ends goes to the sink that it is bound to most. */
static void accrete(struct sim *sim, struct sinks *sinks)
{
    const struct species *gas = &sim->species[GAS];
    int64_t n;
    struct member *sink = list_sinks(sim, &n);
    int32_t *owner = mem_array("sinks", int32_t, gas->n_ending);
    double *within = weigh(sim, sinks, sink, n);
#pragma omp parallel for schedule(dynamic, 256)
    for (int64_t e = 0; e < gas->n_ending; e++) {
        owner[e] = -1;
        if (n == 0 || species_gone(gas, gas->ending[e])) continue;
        const struct member row = member_of(sim, GAS, gas->ending[e]);
        double deepest = 0;
        for (int64_t s = 0; s < n; s++) {
            const double depth = depth_in(sim, sinks, &sink[s], within[s], &row);
            if (!(depth < deepest)) continue;
            deepest = depth;
            owner[e] = (int32_t)s;
        }
    }
    struct member *member = mem_array("sinks", struct member, n > 0 ? gas->n_ending + 1 : 0);
    for (int64_t s = 0; s < n; s++) {
        int64_t count = 1;
        member[0] = sink[s];
        for (int64_t e = 0; e < gas->n_ending; e++)
            if (owner[e] == s) member[count++] = member_of(sim, GAS, gas->ending[e]);
        if (count > 1) swallow(sim, sinks, member, count, sink[s].row);
    }
    mem_free(member);
    mem_free(within);
    mem_free(owner);
    mem_free(sink);
}

/* --- gas that becomes a sink --- */

struct peak { double rho; uint64_t id; int32_t row; };

static int densest_first(const void *a, const void *b)
{
    const struct peak *x = a, *y = b;
    return x->rho != y->rho ? (x->rho < y->rho) - (x->rho > y->rho) : (x->id > y->id) - (x->id < y->id);
}

/* Dense gas that converges, whose step ends, apart from all sinks. */
static struct peak *list_peaks(const struct sim *sim, const struct sinks *sinks, int64_t *n)
{
    const struct species *gas = &sim->species[GAS];
    struct peak *peak = mem_array("sinks", struct peak, gas->n_ending);
    *n = 0;
    for (int64_t e = 0; e < gas->n_ending; e++) {
        const int32_t i = gas->ending[e];
        if (species_gone(gas, i) || !((double)gas->rho[i] > sinks->density) || !(gas->div_v[i] < 0)) continue;
        peak[(*n)++] = (struct peak){(double)gas->rho[i], gas->id[i], i};
    }
    if (*n > 0) qsort(peak, (size_t)*n, sizeof *peak, densest_first);
    return peak;
}

/* The gas within the radius of a peak; NULL if a row of it is denser. */
static struct member *gather(const struct sim *sim, const struct sinks *sinks, int32_t row, int64_t *n)
{
    const struct species *gas = &sim->species[GAS];
    struct member *member = NULL;
    const struct member peak = member_of(sim, GAS, row);
    int64_t room = 0;
    *n = 0;
    for (int64_t i = 0; i < gas->n; i++) {
        double pos[3];
        if (species_gone(gas, i)) continue;
        sim_predict(&sim->time, gas, i, pos);
        if (!(distance2(pos, peak.piece.pos) < sinks->radius * sinks->radius)) continue;
        if (sph_rho_now(sim, i) > gas->rho[row]) {
            mem_free(member);
            return NULL;
        }
        if (*n == room) member = mem_resize("sinks", member, (size_t)(room = 2 * room + 64) * sizeof *member);
        member[(*n)++] = member_of(sim, GAS, i);
    }
    return member;
}

/* E_th <= |E_gr|/2 and E_th + E_kin + E_gr < 0 of the members about their centre; that of rotation is a part of E_kin. */
static bool is_bound(const struct sim *sim, const struct member *member, int64_t n)
{
    const struct sph *sph = sim_state(sim, "sph");
    double thermal = 0;
    for (int64_t m = 0; m < n; m++)
        thermal += 1.5 * member[m].piece.mass * sph_heat(sph, member[m].heat, (double)sph_rho_now(sim, member[m].row));
    struct gravity_piece *piece = pieces_of(member, n);
    const double depth = -gravity_among(sim, piece, n), kinetic = unite(member, n).lost;
    mem_free(piece);
    return 2 * thermal <= depth && thermal + kinetic < depth;
}

/* It has the id of the peak, which is no more. */
static void make_sink(struct sim *sim, struct sinks *sinks, const struct peak *peak, const struct member *member, int64_t n)
{
    const int64_t to = ranks_append(sim, STAR, 1);
    struct species *star = &sim->species[STAR];
    const int rung = timeline_rung(&sim->time, timeline_seconds(&sim->time, (int64_t)1 << sim->species[GAS].rung[peak->row]));
    star->rung[to] = star->rung0[to] = (uint8_t)(rung > 0 ? rung : 0);
    star->id[to] = peak->id;
    star->sink[to] = 1;
    star->birth[to] = timeline_now(&sim->time);
    swallow(sim, sinks, member, n, to);
    sinks->count++;
    log_line("sinks: t = %g: %lld rows, %.4g in mass, become one: number %.0f", timeline_now(&sim->time), (long long)n,
             star->mass[to], sinks->count);
}

static bool is_near(const struct species *star, const double pos[3], double reach)
{
    for (int64_t s = 0; s < star->n; s++)
        if (star->sink[s] && distance2(star->pos[s], pos) < reach * reach) return true;
    return false;
}

/* The densest first; two radii apart from every sink, so that none is made of what another swallows. */
static void form(struct sim *sim, struct sinks *sinks)
{
    int64_t n;
    struct peak *peak = list_peaks(sim, sinks, &n);
    double (*seen)[3] = mem_alloc("sinks", (size_t)(n + 1) * sizeof *seen);
    int64_t tested = 0;
    for (int64_t p = 0; p < n; p++) {
        const struct species *gas = &sim->species[GAS];
        const double *pos = gas->pos[peak[p].row];
        bool known = species_gone(gas, peak[p].row) || is_near(&sim->species[STAR], pos, 2 * sinks->radius);
        for (int64_t t = 0; t < tested && !known; t++) known = distance2(seen[t], pos) < sinks->radius * sinks->radius;
        if (known) continue;
        memcpy(seen[tested++], pos, sizeof *seen);
        int64_t rows;
        struct member *member = gather(sim, sinks, peak[p].row, &rows);
        if (member && is_bound(sim, member, rows)) make_sink(sim, sinks, &peak[p], member, rows);
        mem_free(member);
    }
    mem_free(seen);
    mem_free(peak);
}

/* --- the step --- */

/* All ranks hold all rows and do the same. What is swallowed asks for a new tree: it waits until that pays. */
static void event(struct sim *sim, void *state)
{
    struct sinks *sinks = state;
    uint64_t keep = sim->want_potential ? (uint64_t)1 << COLUMN_pot : 0;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    sinks->untold = 0;
    if (!steps_births_due(sim)) return;
    accrete(sim, sinks);
    form(sim, sinks);
}

static double longest(const struct sim *sim, const struct sinks *sinks, const struct species *star, int64_t i)
{
    return sinks->time_step * sqrt(pow(sinks->radius, 3) / (sim->units.G * star->mass[i]));
}

static void limit(struct sim *sim, void *state)
{
    struct species *star = &sim->species[STAR];
    for (int64_t a = 0; a < star->n_active; a++) {
        const int64_t i = star->active[a];
        if (star->sink[i]) star->dt[i] = fminf(star->dt[i], (float)longest(sim, state, star, i));
    }
}

static void reason(const struct sim *sim, const void *state, const struct species *s, int64_t i, struct step_reason *step)
{
    if (s->kind != STAR || !s->sink[i]) return;
    const double dt = longest(sim, state, s, i);
    if (dt < step->dt) *step = (struct step_reason){dt, "sinks.time_step"};
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct sinks *sinks = state;
    const double one = comm_rank() == 0;
    sink->add(sink, "radiated_sinks", one * sinks->radiated);
    if (sim->species[GAS].u) sink->add(sink, "booked_sinks_heat", one * sinks->heat);
    sink->add(sink, "booked_sinks_bound", one * (sinks->bound + sinks->untold));
}

/* Rates are the means since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct sinks *sinks = state;
    const double one = comm_rank() == 0, now = timeline_now(&sim->time), span = now - sinks->at;
    const char *const unit[] = {"M", "M L^-1 V"}, *const name[] = {"sink_mass", "sink_rate"};
    const double value[] = {sinks->mass, span > 0 ? (sinks->mass - sinks->told) / span : 0};
    sink->add(sink, "sinks [1]", one * sinks->count);
    for (int c = 0; c < 2; c++) {
        char text[64], column[96];
        layout_unit_text(sim->units.physical, unit[c], text, sizeof text);
        snprintf(column, sizeof column, "%s [%s]", name[c], text);
        sink->add(sink, column, one * value[c] * layout_factor(&sim->units, unit[c]));
    }
    sinks->told = sinks->mass;
    sinks->at = now;
}

const struct module sinks_module = {
    .name = "sinks", .whole = true, .open_space = true, .doc = "collapsed gas becomes rows that swallow what falls on them",
    .kind = MODULE_BLOCK, .params = params, .requires = needed, .state_bytes = sizeof(struct sinks), .saved = saved,
    .declare = declare, .begin = begin, .energy = energy, .budget = budget, .reason = reason, .warn = warn,
    .hook = {[HOOK_EVENT] = event, [HOOK_LIMIT] = limit},
};
