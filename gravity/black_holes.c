/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module black_holes: which star rows are some is known from the column `hole`; here their bound pairs are followed
 * in binaries.csv, a row for every bound pair wherever energy.csv has one. The orbit is Kepler's of the two alone,
 * without softening and without what lies between them. See doc/manual/black-holes.md. */
#include "black_holes.h"
#include "comm.h"
#include "file/layout.h"
#include "file/series.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "output.h"
#include "ranks.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct param params[] = {
    {"softening", PARAM_REAL, "length", "0", 0, 1e300, NULL, "Plummer's softening length of black holes, as gravity.softening",
     true, offsetof(struct black_holes, softening)},
    {0}
};

static const struct saved saved[] = {
    {"last", offsetof(struct black_holes, last), sizeof(struct black_hole_pair[BLACK_HOLE_PAIRS])},
    {"n_last", offsetof(struct black_holes, n_last), sizeof(int64_t)},
    {0}
};

static const char *const needed[] = {"gravity", NULL};

static void declare(struct sim *sim, void *state)
{
    (void)state;
    species_need(&sim->species[STAR], COLUMN_hole);
}

struct hole { uint64_t id; double mass, pos[3], vel[3]; };

static int by_id(const void *a, const void *b)
{
    uint64_t x = ((const struct hole *)a)->id, y = ((const struct hole *)b)->id;
    return (x > y) - (x < y);
}

/* Those of all ranks by their ids, for mem_free. Their steps end now. */
static struct hole *gather(const struct sim *sim, int64_t *n)
{
    const struct species *star = &sim->species[STAR];
    int64_t *count = mem_array("black_holes", int64_t, comm_size()), own = 0, before = 0;
    for (int64_t i = star->own; i < star->own + star->n_own; i++) own += black_hole_is(star, i);
    comm_gather_counts(own, count);
    *n = 0;
    for (int r = 0; r < comm_size(); r++) {
        if (r < comm_rank()) before += count[r];
        *n += count[r];
        count[r] *= (int64_t)sizeof(struct hole);
    }
    struct hole *hole = mem_array("black_holes", struct hole, *n + 1);
    for (int64_t i = star->own; i < star->own + star->n_own; i++) {
        if (!black_hole_is(star, i)) continue;
        struct hole *h = &hole[before++];
        *h = (struct hole){.id = star->id[i], .mass = star->mass[i]};
        memcpy(h->pos, star->pos[i], sizeof h->pos);
        memcpy(h->vel, star->vel[i], sizeof h->vel);
    }
    comm_gather_all(hole, count);
    qsort(hole, (size_t)*n, sizeof *hole, by_id);
    mem_free(count);
    return hole;
}

struct orbit { double separation, inverse_axis, eccentricity; };

/* Kepler's orbit of two points. */
static struct orbit orbit_of(double G, const struct hole *a, const struct hole *b)
{
    double r[3], v[3], v2 = 0, r2 = 0, l2 = 0;
    const double GM = G * (a->mass + b->mass);
    for (int k = 0; k < 3; k++) {
        r[k] = b->pos[k] - a->pos[k];
        v[k] = b->vel[k] - a->vel[k];
        r2 += r[k] * r[k];
        v2 += v[k] * v[k];
    }
    for (int k = 0; k < 3; k++) {
        double l = r[(k + 1) % 3] * v[(k + 2) % 3] - r[(k + 2) % 3] * v[(k + 1) % 3];
        l2 += l * l;
    }
    struct orbit orbit = {.separation = sqrt(r2), .inverse_axis = 2 / sqrt(r2) - v2 / GM};
    orbit.eccentricity = sqrt(fmax(0, 1 - l2 / GM * orbit.inverse_axis));
    return orbit;
}

static const struct black_hole_pair *last_of(const struct black_holes *b, const struct hole *x, const struct hole *y)
{
    for (int64_t i = 0; i < b->n_last; i++)
        if (b->last[i].id[0] == x->id && b->last[i].id[1] == y->id) return &b->last[i];
    return NULL;
}

static void write_header(FILE *file, const void *context)
{
    static const struct { const char *name, *unit; } column[] = {
        {"mass_1", "M"}, {"mass_2", "M"}, {"separation", "L"}, {"semi_major_axis", "L"}, {"eccentricity", ""},
        {"hardening", "L^-2 V"}};
    const struct sim *sim = context;
    fprintf(file, ",id_1,id_2");
    for (size_t c = 0; c < sizeof column / sizeof *column; c++) {
        char unit[64];
        layout_unit_text(sim->units.physical, column[c].unit, unit, sizeof unit);
        fprintf(file, *unit ? ",%s [%s]" : ",%s", column[c].name, unit);
    }
}

static void write_pair(const struct sim *sim, FILE *file, const struct hole *x, const struct hole *y,
                       const struct orbit *orbit, const struct black_hole_pair *last)
{
    const struct units *units = &sim->units;
    const double l = layout_factor(units, "L"), m = layout_factor(units, "M"), now = timeline_now(&sim->time);
    series_time(sim, file);
    fprintf(file, ",%llu,%llu,%.10g,%.10g,%.10g,%.10g,%.10g,", (unsigned long long)x->id, (unsigned long long)y->id,
            m * x->mass, m * y->mass, l * orbit->separation, l / orbit->inverse_axis, orbit->eccentricity);
    if (last)
        fprintf(file, "%.10g", layout_factor(units, "L^-2 V") * (orbit->inverse_axis - last->inverse_axis) / (now - last->time));
    fprintf(file, "\n");
}

static void record(struct sim *sim, void *state)
{
    struct black_holes *b = state;
    const struct output *output = sim_state(sim, "output");
    if (!sim->synchronous || output->recorded != sim->time.tick || !sim->folder) return;
    int64_t n;
    struct hole *hole = gather(sim, &n);
    struct black_holes now = {.softening = b->softening};
    FILE *file = comm_rank() == 0 ? series_open(sim, "binaries.csv", write_header, sim) : NULL;
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = i + 1; j < n; j++) {
            struct orbit orbit = orbit_of(sim->units.G, &hole[i], &hole[j]);
            if (!(orbit.inverse_axis > 0)) continue;
            if (file) write_pair(sim, file, &hole[i], &hole[j], &orbit, last_of(b, &hole[i], &hole[j]));
            if (now.n_last < BLACK_HOLE_PAIRS)
                now.last[now.n_last++] = (struct black_hole_pair){{hole[i].id, hole[j].id}, timeline_now(&sim->time),
                                                                  orbit.inverse_axis};
        }
    if (file) series_close(sim, "binaries.csv", file);
    *b = now;
    mem_free(hole);
}

static void warn(struct sim *sim, void *state)
{
    const struct black_holes *b = state;
    const struct species *star = &sim->species[STAR];
    double holes = 0;
    for (int64_t i = species_from(star); i < species_to(star); i++) holes += black_hole_is(star, i);
    ranks_sum(sim, &holes, 1);
    if (holes == 0)
        log_warning("black_holes: the start has none (their rows are marked in the data set BlackHole of a file, or made by a "
                    "generator's key start.holes)");
    else if (holes > 1)
        log_warning("black_holes.softening = %g: a binary of black holes whose pericentre comes below the softening, or which "
                    "stays bound for thousands of orbits, needs regularisation, which tephra does not do: beyond that "
                    "binaries.csv tells of the softened or drifting orbit", b->softening);
}

const struct module black_holes_module = {
    .name = "black_holes", .open_space = true, .doc = "star rows that are black holes: softening of their own, bound pairs",
    .params = params, .requires = needed, .state_bytes = sizeof(struct black_holes), .saved = saved, .declare = declare,
    .hook = {[HOOK_RECORD] = record}, .warn = warn,
};
