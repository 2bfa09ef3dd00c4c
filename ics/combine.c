/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two objects from files, whatever they are made of, on a Kepler orbit about their common centre of mass (orbit.h). */
#include "file/start_file.h"
#include "log.h"
#include "orbit.h"

struct combine { char *file[2]; struct orbit orbit; };

static const struct param params[] = {
    {"first", PARAM_PATH, "", NULL, 0, 0, NULL, "file with the first object, of any format that start.file takes", false,
     offsetof(struct combine, file[0])},
    {"second", PARAM_PATH, "", NULL, 0, 0, NULL, "file with the second; may be the same", false, offsetof(struct combine, file[1])},
    ORBIT_PARAMS(combine, "object", "0 deg", "0 deg")
    {0}
};

/* The rows that an object has of each table, its centre of mass and its velocity. */
struct object { int64_t first[N_SPECIES], n[N_SPECIES]; double mass, pos[3], vel[3]; };

static void read_object(struct sim *sim, const char *path, uint64_t shift, struct object *object)
{
    *object = (struct object){0};
    for (int s = 0; s < N_SPECIES; s++) object->first[s] = sim->species[s].n;
    start_file_add(sim, path, shift);
    for (int s = 0; s < N_SPECIES; s++) {
        const struct species *table = &sim->species[s];
        object->n[s] = table->n - object->first[s];
        for (int64_t i = object->first[s]; i < table->n; i++) {
            object->mass += table->mass[i];
            for (int k = 0; k < 3; k++) {
                object->pos[k] += table->mass[i] * table->pos[i][k];
                object->vel[k] += table->mass[i] * table->vel[i][k];
            }
        }
    }
    for (int k = 0; k < 3; k++) {
        object->pos[k] /= object->mass;
        object->vel[k] /= object->mass;
    }
}

/* Turned about its centre of mass, which goes to the given part of the relative orbit. */
static void move(struct sim *sim, const struct object *object, const double angle[2], double part, const double x[2],
                 const double v[2])
{
    for (int s = 0; s < N_SPECIES; s++) {
        struct species *table = &sim->species[s];
        for (int64_t i = object->first[s]; i < object->first[s] + object->n[s]; i++) {
            double *pos = table->pos[i], *vel = table->vel[i];
            for (int k = 0; k < 3; k++) {
                pos[k] -= object->pos[k];
                vel[k] -= object->vel[k];
            }
            orbit_turn(pos, angle[0], angle[1]);
            orbit_turn(vel, angle[0], angle[1]);
            for (int k = 0; k < 2; k++) {
                pos[k] += part * x[k];
                vel[k] += part * v[k];
            }
        }
    }
}

static uint64_t largest_id(struct sim *sim)
{
    uint64_t last = 0;
    for_species(sim, table)
        for (int64_t i = 0; i < table->n; i++) last = table->id[i] > last ? table->id[i] : last;
    return last;
}

/* The object's clock showed `then` in its file and begins anew: stars keep their ages. */
static void keep_ages(struct sim *sim, const struct object *object, double then)
{
    const struct species *star = &sim->species[STAR];
    for (int64_t i = object->first[STAR]; star->birth && i < star->n; i++) star->birth[i] -= then;
}

/* Ids of rows that were born, or are children of the second file's, may leave none to children of theirs (species_child).
 * Object by object, so that the ids still tell them apart; returns the largest of the first. */
static uint64_t number_anew(struct sim *sim, const struct object object[2])
{
    uint64_t id = 0, largest = 0;
    for (int o = 0; o < 2; o++) {
        for (int s = 0; s < N_SPECIES; s++) {
            struct species *table = &sim->species[s];
            for (int64_t i = object[o].first[s]; i < object[o].first[s] + object[o].n[s]; i++) {
                table->id[i] = ++id;
                if (table->children) table->children[i] = 0;
            }
        }
        if (o == 0) largest = id;
    }
    return largest;
}

static void combine_make(struct sim *sim, const void *state, int64_t n)
{
    const struct combine *combine = state;
    struct object object[2];
    double x[2], v[2];
    uint64_t first = 0;
    (void)n;
    for (int o = 0; o < 2; o++) {
        sim->time.start = 0;
        if (o) first = largest_id(sim);
        read_object(sim, combine->file[o], first, &object[o]);
        if (sim->problems.count > 0) return;
        keep_ages(sim, &object[o], sim->time.start);
    }
    sim->time.start = 0;
    if (largest_id(sim) >> 48 != 0) first = number_anew(sim, object);
    log_line("combine: ids up to %llu are the first object's (profiles.split)", (unsigned long long)first);
    const double mass = object[0].mass + object[1].mass;
    if (!orbit_place(sim, &combine->orbit, mass, x, v)) return;
    for (int o = 0; o < 2; o++) {
        const double angle[2] = {combine->orbit.inclination[o], combine->orbit.azimuth[o]};
        move(sim, &object[o], angle, o ? object[0].mass / mass : -object[1].mass / mass, x, v);
    }
}

const struct generator combine_generator = {
    .name = "combine", .doc = "two objects from files on a Kepler orbit", .params = params, .state_bytes = sizeof(struct combine),
    .own_n = true, .make = combine_make,
};
