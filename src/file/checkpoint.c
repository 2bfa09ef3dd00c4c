/* SPDX-License-Identifier: GPL-3.0-or-later
 * Writes and reads checkpoints (checkpoint.h). Groups: Checkpoint (format, modules, fields of the
 * simulation), State/<module> (what it saves), Rows/<species> (columns), and Header, Units and
 * Provenance as in a snapshot. Numbers other than columns are stored as the bytes they are: they are
 * read back by the program that wrote them, or refused. */
#include "checkpoint.h"
#include "comm.h"
#include "h5.h"
#include "mem.h"
#include "module.h"
#include "provenance.h"
#include "ranks.h"
#include "slices.h"
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { FORMAT = 3 };    /* raised by every change that makes older files unreadable */

#define FIELD(name, member) {name, offsetof(struct sim, member), sizeof ((struct sim *)0)->member}
static const struct saved sim_fields[] = {
    FIELD("start", time.start),     FIELD("dt_max", time.dt_max), FIELD("tick", time.tick),
    FIELD("seed", seed),            FIELD("steps", steps),        FIELD("updates", updates),
    {0}
};
#undef FIELD

enum { LIST = 4096, GROUP = 200, PLACE = 2 * GROUP };   /* bytes of a list of names, of paths in the file */

static void list_modules(const struct sim *sim, char text[LIST])
{
    int used = 0;
    text[0] = 0;
    for (int u = 0; u < sim->n_use && used < LIST; u++)
        used += snprintf(text + used, (size_t)(LIST - used), "%s%s", u ? " " : "", sim->use[u].module->name);
}

static bool kept(const struct species *table, int column)
{
    return species_has(table, column) && column_table[column].lifetime == KEEP;
}

static void list_columns(const struct species *table, char text[LIST])
{
    int used = 0;
    text[0] = 0;
    for (int c = 0; c < N_COLUMNS && used < LIST; c++)
        if (kept(table, c))
            used += snprintf(text + used, (size_t)(LIST - used), "%s%s", used ? " " : "", column_table[c].name);
}

static char column_kind(int column)
{
    return column_table[column].element_bytes == 1 ? 'b' : column_table[column].kind;
}

/* --- writing --- */

static void write_fields(struct h5 *file, const char *group, const struct saved *fields, const void *from)
{
    for (const struct saved *f = fields; f && f->name; f++) {
        char path[PLACE];
        snprintf(path, sizeof path, "%s/%s", group, f->name);
        h5_write(file, path, 'b', (int64_t)f->bytes, 1, (const char *)from + f->offset);
    }
}

/* file: NULL on other ranks than the first. */
static void write_rows(struct h5 *file, const struct sim *sim, const struct species *table)
{
    char path[PLACE], columns[LIST];
    snprintf(path, sizeof path, "Rows/%s", species_names[table->kind]);
    list_columns(table, columns);
    if (file) {
        h5_group(file, path);
        h5_attr_int(file, path, "rows", table->n);
        h5_attr_text(file, path, "columns", columns);
    }
    struct slices rows = slices_of_rows(sim, table);
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!kept(table, c)) continue;
        snprintf(path, sizeof path, "Rows/%s/%s", species_names[table->kind], column_table[c].name);
        const struct slices_set set = {file, path, column_kind(c), column_table[c].components};
        slices_write_rows(&rows, &set, (const char *)species_column(table, c) + (size_t)species_from(table) * species_row_bytes(c));
        if (file) h5_attr_text(file, path, "description", column_table[c].text);
    }
    slices_free(&rows);
}

/* Time and units, so that `tephra info` need not know of checkpoints. */
static void write_header(struct h5 *file, const struct sim *sim)
{
    h5_group(file, "Header");
    h5_attr_double(file, "Header", "Time", timeline_now(&sim->time));
    h5_group(file, "Units");
    h5_attr_double(file, "Units", "UnitLength_in_cm", sim->units.length);
    h5_attr_double(file, "Units", "UnitMass_in_g", sim->units.mass);
    h5_attr_double(file, "Units", "UnitVelocity_in_cm_per_s", sim->units.velocity);
    h5_attr_text(file, "Units", "units", sim->units.physical ? "code units of the scene" : "none");
}

/* checkpoint.previous.hdf5 for checkpoint.hdf5. */
static char *previous_path(const char *path)
{
    static const char ending[] = ".hdf5";
    size_t length = strlen(path), stem = length;
    if (length > strlen(ending) && strcmp(path + length - strlen(ending), ending) == 0) stem -= strlen(ending);
    return mem_format("files", "%.*s.previous%s", (int)stem, path, ending);
}

/* checkpoint.hdf5 becomes checkpoint.previous.hdf5 while its own name stays: a second link, where
 * the file system knows links. */
static void keep_previous(const char *path)
{
    char *previous = previous_path(path);
    if (access(path, F_OK) == 0) {
        unlink(previous);
        if (link(path, previous) != 0) rename(path, previous);
    }
    mem_free(previous);
}

/* All but the rows. */
static void write_head(struct h5 *file, const struct sim *sim)
{
    char text[LIST];
    h5_group(file, "Checkpoint");
    list_modules(sim, text);
    h5_attr_int(file, "Checkpoint", "format", FORMAT);
    h5_attr_text(file, "Checkpoint", "modules", text);
    write_header(file, sim);
    provenance_write(file, sim);
    write_fields(file, "Checkpoint", sim_fields, sim);
    for (int u = 0; u < sim->n_use; u++) {
        char group[GROUP];
        snprintf(group, sizeof group, "State/%s", sim->use[u].module->name);
        write_fields(file, group, sim->use[u].module->saved, sim->use[u].state);
    }
}

void checkpoint_write(const struct sim *sim, const char *path)
{
    const bool first = comm_rank() == 0;
    if (!first && !sim->spread) return;
    struct h5 *file = first ? h5_create(path) : NULL;
    if (first) write_head(file, sim);
    for (int s = 0; s < N_SPECIES; s++)
        if (sim->species[s].n > 0) write_rows(file, sim, &sim->species[s]);
    if (!first) return;
    keep_previous(path);
    h5_close(file);
}

/* --- reading --- */

static void read_fields(struct h5 *file, const char *group, const struct saved *fields, void *to)
{
    for (const struct saved *f = fields; f && f->name; f++) {
        char path[PLACE];
        snprintf(path, sizeof path, "%s/%s", group, f->name);
        h5_read(file, path, 'b', (int64_t)f->bytes, 1, (char *)to + f->offset);
    }
}

/* Whether the list of names at place[0] (object) and place[1] (attribute) is the run's own. */
static bool same_list(struct sim *sim, struct h5 *file, const char *place[2], const char *path, const char *own)
{
    char *text = h5_read_attr_text(file, place[0], place[1]);
    bool same = text && strcmp(text, own) == 0;
    if (!same)
        problems_add(&sim->problems, "%s was written with the %s \"%s\"; this run has \"%s\": "
                     "continue with the scene and the program that wrote it", path, place[1], text ? text : "", own);
    mem_free(text);
    return same;
}

static void read_rows(struct sim *sim, struct h5 *file, const char *path, struct species *table)
{
    char group[GROUP], own[LIST];
    double rows = 0;
    snprintf(group, sizeof group, "Rows/%s", species_names[table->kind]);
    if (!h5_read_attr(file, group, "rows", &rows, 1)) return;
    list_columns(table, own);
    if (!same_list(sim, file, (const char *[2]){group, "columns"}, path, own)) return;
    const int64_t all = (int64_t)rows, from = sim->spread ? all * comm_rank() / comm_size() : 0;
    const struct h5_part part = {all, from, sim->spread ? all * (comm_rank() + 1) / comm_size() - from : all};
    if (sim->spread) {
        species_reserve_part(table, all, part.first, part.rows);
    } else {
        species_reserve(table, all);
        table->n = table->n_own = all;
    }
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!kept(table, c)) continue;
        char set[PLACE];
        snprintf(set, sizeof set, "%s/%s", group, column_table[c].name);
        h5_read_rows(file, set, column_kind(c), part, column_table[c].components,
                     (char *)species_column(table, c) + (size_t)part.first * species_row_bytes(c));
    }
}

/* The cadences of the scene, in the ticks of the checkpoint. Rungs are relative to its longest step,
 * so that a cadence must be a multiple of that. */
static void adopt_ticks(struct sim *sim, const char *path, double dt_max)
{
    int64_t *cadence[] = {&sim->time.snapshot, &sim->time.energy, &sim->time.checkpoint, &sim->time.picture};
    const double longest = (double)((int64_t)1 << RUNG_TOP), never = 0x1p62, ratio = dt_max / sim->time.dt_max;
    int power;
    bool fits = frexp(ratio, &power) == 0.5;
    for (int i = 0; i < 4; i++) {
        double ticks = ratio * (double)*cadence[i];
        fits = fits && fmod(ticks, longest) == 0;
        if (fits) *cadence[i] = (int64_t)fmin(ticks, never);
    }
    if (!fits)
        problems_add(&sim->problems, "%s has a longest step of %.17g, this scene one of %.17g: a run is continued "
                     "with cadences that are 1, 2, 4... times its longest step", path, sim->time.dt_max, dt_max);
}

static void read_all(struct sim *sim, struct h5 *file, const char *path)
{
    double format = 0, dt_max = sim->time.dt_max;
    char own[LIST];
    if (!h5_read_attr(file, "Checkpoint", "format", &format, 1)) {
        problems_add(&sim->problems, "%s is not a checkpoint of tephra", path);
        return;
    }
    if (format != FORMAT) {
        problems_add(&sim->problems, "%s has checkpoint format %g; this program reads format %d", path, format, FORMAT);
        return;
    }
    list_modules(sim, own);
    if (!same_list(sim, file, (const char *[2]){"Checkpoint", "modules"}, path, own)) return;
    provenance_check(file, sim, path);
    read_fields(file, "Checkpoint", sim_fields, sim);
    adopt_ticks(sim, path, dt_max);
    for (int u = 0; u < sim->n_use; u++) {
        char group[GROUP];
        snprintf(group, sizeof group, "State/%s", sim->use[u].module->name);
        read_fields(file, group, sim->use[u].module->saved, sim->use[u].state);
    }
    for (int s = 0; s < N_SPECIES; s++) read_rows(sim, file, path, &sim->species[s]);
}

void checkpoint_read(struct sim *sim, const char *path)
{
    struct h5 *file = h5_open(path);
    if (!h5_error(file)) read_all(sim, file, path);
    char *wrong = NULL;
    if (h5_error(file)) {
        char *previous = previous_path(path);
        bool there = access(previous, R_OK) == 0;
        wrong = mem_format("files", "%s %s%s%s%s", path, h5_error(file), there ? "; the one before it is " : "",
                           there ? previous : "", there ? ": give it this name to go on from there" : "");
        mem_free(previous);
    }
    ranks_tell(sim, wrong);
    mem_free(wrong);
    h5_close(file);
}
