/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra info`: what a snapshot, a checkpoint or another code's file holds. */
#include "cmd.h"
#include "file/formats.h"
#include "file/h5.h"
#include "file/layout.h"
#include "file/tables.h"
#include "mem.h"
#include "module.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const char usage[] = "info FILE.hdf5";

/* Sums over the rows of all tables, in the file's units. */
struct totals {
    double mass, centre[3], momentum[3], angular[3], kinetic, thermal, potential;
    bool has_u, has_potential;
    int64_t rows;
};

static void print_text(struct h5 *file, const char *group, const char *name, const char *label)
{
    char *text = h5_read_attr_text(file, group, name);
    if (text && *text) printf("  %-18s %s\n", label, text);
    mem_free(text);
}

static void print_number(struct h5 *file, const char *group, const char *name, const char *label)
{
    double value;
    if (h5_read_attr(file, group, name, &value, 1)) printf("  %-18s %.9g\n", label, value);
}

static void print_header(struct h5 *file, const char *path)
{
    static const struct { const char *group, *name, *label; } rows[] = {
        {"Header", "Time", "time"}, {"Header", "Time_GYR", "time in Gyr"}, {"Header", "BoxSize", "box"},
        {"Header", "Redshift", "redshift"}, {"Units", "UnitLength_in_cm", "length in cm"},
        {"Units", "UnitMass_in_g", "mass in g"}, {"Units", "UnitVelocity_in_cm_per_s", "velocity in cm/s"},
        {"Provenance", "G", "G in code units"}, {"Checkpoint", "format", "checkpoint format"},
    };
    char *units = h5_read_attr_text(file, "Units", "units");
    printf("%s\n", path);
    print_text(file, "Provenance", "title", "title");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        print_number(file, rows[i].group, rows[i].name, rows[i].label);
    print_text(file, "Checkpoint", "modules", "modules");
    if (units) printf("  %-18s %s\n", "units", units);
    if (units && strcmp(units, "none") == 0 && h5_exists(file, "Parameters"))
        printf("  %-18s yt.load(\"%s\", unit_base={\"length\": (1, \"cm\"), \"mass\": (1, \"g\"), "
               "\"velocity\": (1, \"cm/s\")})\n", "for yt", path);
    mem_free(units);
}

/* Smallest and largest number of a data set, and how many are none. */
static void print_set(struct h5 *file, const struct table *table, const char *set)
{
    char path[2 * TABLES_NAME];
    int components = 1;
    tables_path(table, set, path);
    double *value = tables_read(file, table, set, &components), low = INFINITY, high = -INFINITY;
    char *units = h5_read_attr_text(file, path, "units");
    int64_t strange = 0;
    for (int64_t i = 0; i < table->rows * components; i++) {
        if (!isfinite(value[i])) strange++;
        low = fmin(low, value[i]);
        high = fmax(high, value[i]);
    }
    char width[16] = "";
    if (components > 1) snprintf(width, sizeof width, " x%d", components);
    printf("  %-18s %c%-3s ", set, h5_kind(file, path), width);
    if (low <= high) printf("%14.6g ... %-14.6g", low, high);
    else printf("%14s%19s", "none", "");
    if (units && strcmp(units, "1") != 0) printf(" %s", units);
    if (strange > 0) printf("  (%" PRId64 " not finite)", strange);
    printf("\n");
    mem_free(units);
    mem_free(value);
}

static void print_table(struct h5 *file, const struct table *table)
{
    printf("%s: %" PRId64 " rows%s%s\n", table->species, table->rows, *table->group ? ", group " : "", table->group);
    for (int i = 0; i < table->n_sets; i++) print_set(file, table, table->set[i]);
}

/* GADGET's files may state one mass for all rows of a type. */
static double *read_masses(struct h5 *file, const struct table *table)
{
    int components;
    double *mass = tables_read(file, table, table->mass, &components), each[LAYOUT_TYPES];
    int type;
    if (mass || sscanf(table->group, "PartType%d", &type) != 1
        || !h5_read_attr(file, "Header", "MassTable", each, LAYOUT_TYPES)) return mass;
    mass = mem_array("files", double, table->rows);
    for (int64_t i = 0; i < table->rows; i++) mass[i] = each[type];
    return mass;
}

static void add_row(struct totals *t, double mass, const double *pos, const double *vel)
{
    t->mass += mass;
    for (int k = 0; k < 3; k++) {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        t->centre[k] += mass * pos[k];
        t->momentum[k] += mass * vel[k];
        t->angular[k] += mass * (pos[a] * vel[b] - pos[b] * vel[a]);
        t->kinetic += 0.5 * mass * vel[k] * vel[k];
    }
}

static void add_table(struct h5 *file, const struct table *table, struct totals *t)
{
    int three = 0, moving = 0, one;
    double *pos = tables_read(file, table, table->pos, &three), *vel = tables_read(file, table, table->vel, &moving);
    double *mass = read_masses(file, table);
    double *u = tables_read(file, table, table->u, &one), *pot = tables_read(file, table, table->pot, &one);
    t->has_u = t->has_u || u;
    t->has_potential = t->has_potential && pot;
    t->rows += table->rows;
    for (int64_t i = 0; i < table->rows && mass && three == 3 && moving == 3; i++) {
        add_row(t, mass[i], pos + 3 * i, vel + 3 * i);
        if (u) t->thermal += mass[i] * u[i];
        if (pot) t->potential += 0.5 * mass[i] * pot[i];
    }
    double *all[] = {pos, vel, mass, u, pot};
    for (int i = 0; i < 5; i++) mem_free(all[i]);
}

static void print_vector(const char *label, const double v[3], double divide)
{
    printf("  %-18s %.9g %.9g %.9g\n", label, v[0] / divide, v[1] / divide, v[2] / divide);
}

static void print_totals(const struct totals *t)
{
    if (!(t->mass > 0)) return;
    printf("all: %" PRId64 " rows\n  %-18s %.15g\n", t->rows, "mass", t->mass);
    print_vector("centre of mass", t->centre, t->mass);
    print_vector("momentum", t->momentum, 1);
    print_vector("angular momentum", t->angular, 1);
    printf("  %-18s %.9g\n", "kinetic energy", t->kinetic);
    if (t->has_u) printf("  %-18s %.9g\n", "thermal energy", t->thermal);
    if (t->has_potential) printf("  %-18s %.9g\n", "potential energy", t->potential);
}

static void print_provenance(struct h5 *file)
{
    static const char *const texts[] = {"program", "commit", "compiler", "host"};
    static const char *const numbers[] = {"ranks", "threads", "seed", "steps", "updates"};
    if (!h5_exists(file, "Provenance")) return;
    printf("made by\n");
    for (int i = 0; i < 4; i++) print_text(file, "Provenance", texts[i], texts[i]);
    for (int i = 0; i < 5; i++) print_number(file, "Provenance", numbers[i], numbers[i]);
    char *scene = h5_read_attr_text(file, "Provenance", "scene");
    if (scene) printf("scene\n%s", scene);
    mem_free(scene);
}

static int info_run(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "", usage)) return STATUS_DONE;
    if (options.n_arguments != 1) fail(STATUS_INPUT, "usage: tephra %s", usage);
    const char *path = options.argument[0];
    struct h5 *file = formats_open(path);
    if (h5_error(file)) fail(STATUS_INPUT, "%s %s", path, h5_error(file));
    struct table *tables = mem_array("files", struct table, TABLES_MOST);
    struct totals totals = {.has_potential = true};
    int count = tables_find(file, tables);
    print_header(file, path);
    for (int t = 0; t < count; t++) print_table(file, &tables[t]);
    for (int t = 0; t < count; t++) add_table(file, &tables[t], &totals);
    print_totals(&totals);
    print_provenance(file);
    if (count == 0) printf("no particles\n");
    if (h5_error(file)) fail(STATUS_INPUT, "%s %s", path, h5_error(file));
    mem_free(tables);
    h5_close(file);
    return STATUS_DONE;
}

const struct command info_command = {"info", usage, "what a snapshot or checkpoint holds", info_run};
