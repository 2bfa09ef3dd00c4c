/* SPDX-License-Identifier: GPL-3.0-or-later
 * Finds and reads the tables of a file (tables.h). */
#include "tables.h"
#include "h5.h"
#include "layout.h"
#include "mem.h"
#include <stdio.h>
#include <string.h>

struct collector { struct h5 *file; struct table *table; };

void tables_path(const struct table *table, const char *set, char path[2 * TABLES_NAME])
{
    snprintf(path, 2 * TABLES_NAME, "%s%s%s", table->group, *table->group ? "/" : "", set);
}

static void collect(const char *name, void *context)
{
    const struct collector *c = context;
    char path[2 * TABLES_NAME];
    int64_t rows;
    int components;
    if (c->table->n_sets == TABLES_SETS || strlen(name) >= TABLES_NAME) return;
    tables_path(c->table, name, path);
    if (h5_kind(c->file, path) && h5_shape(c->file, path, &rows, &components) && rows == c->table->rows)
        strcpy(c->table->set[c->table->n_sets++], name);
}

/* Completes a table whose group and names are set; false if there is no such table. */
static bool complete(struct h5 *file, struct table *table)
{
    char path[2 * TABLES_NAME];
    int components;
    tables_path(table, table->pos, path);
    if (!h5_exists(file, path)) tables_path(table, table->id, path);
    if (!h5_shape(file, path, &table->rows, &components)) return false;
    h5_list(file, *table->group ? table->group : "/", collect, &(struct collector){file, table});
    char *species = *table->group ? h5_read_attr_text(file, table->group, "species") : NULL;
    if (species) snprintf(table->species, TABLES_NAME, "%s", species);
    mem_free(species);
    return true;
}

int tables_find(struct h5 *file, struct table tables[TABLES_MOST])
{
    const struct table snapshot = {.pos = "Coordinates", .vel = "Velocities", .mass = "Masses", .id = "ParticleIDs",
                                   .u = "InternalEnergy", .pot = "Potential"};
    const struct table checkpoint = {.pos = "pos", .vel = "vel", .mass = "mass", .id = "id", .u = "u", .pot = ""};
    int count = 0;
    for (int t = 0; t < LAYOUT_TYPES; t++) {
        tables[count] = snapshot;
        snprintf(tables[count].group, TABLES_NAME, "PartType%d", t);
        strcpy(tables[count].species, tables[count].group);
        count += complete(file, &tables[count]);
    }
    for (int s = 0; s < N_SPECIES; s++) {
        tables[count] = checkpoint;
        snprintf(tables[count].group, TABLES_NAME, "Rows/%s", species_names[s]);
        strcpy(tables[count].species, species_names[s]);
        count += complete(file, &tables[count]);
    }
    tables[count] = snapshot;
    strcpy(tables[count].species, "all");
    return count + complete(file, &tables[count]);
}

bool tables_has(const struct table *table, const char *set)
{
    for (int i = 0; i < table->n_sets; i++)
        if (strcmp(table->set[i], set) == 0) return true;
    return false;
}

double *tables_read(struct h5 *file, const struct table *table, const char *set, int *components)
{
    char path[2 * TABLES_NAME];
    int64_t rows;
    if (!tables_has(table, set)) return NULL;
    tables_path(table, set, path);
    h5_shape(file, path, &rows, components);
    double *values = mem_array("files", double, rows * *components);
    h5_read(file, path, 'd', rows, *components, values);
    return values;
}

uint64_t *tables_read_ids(struct h5 *file, const struct table *table)
{
    char path[2 * TABLES_NAME];
    uint64_t *id = mem_array("files", uint64_t, table->rows);
    tables_path(table, table->id, path);
    if (tables_has(table, table->id)) h5_read(file, path, 'u', table->rows, 1, id);
    else for (int64_t i = 0; i < table->rows; i++) id[i] = (uint64_t)i + 1;
    return id;
}
