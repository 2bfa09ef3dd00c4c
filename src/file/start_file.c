/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reads initial conditions (start_file.h). Tolerant of names and precisions, strict about numbers:
 * a NaN, a negative mass or an id used twice is refused with the particle's id. */
#include "start_file.h"
#include "comm.h"
#include "formats.h"
#include "h5.h"
#include "layout.h"
#include "log.h"
#include "mem.h"
#include "ranks.h"
#include "start_check.h"
#include "start_cosmology.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The rows of a group that are read here: rows [first, first + n) of the species, from the group's row `skip` on, of `all`. */
struct part { int64_t first, n, skip, all; };
/* Of a group without ids. */
struct unnumbered { struct species *table; struct part part; };

struct reader {
    struct sim *sim;
    struct h5 *file;
    const char *path;
    struct layout_unit unit;    /* of the file, over the scene's code unit */
    struct start_cosmology cosmology;
    bool swift;
    int64_t with_kelvin;        /* gas rows whose u came from a temperature */
    uint64_t shift;             /* added to ids */
    double mass_table[LAYOUT_TYPES], count[LAYOUT_TYPES];
    struct unnumbered unnumbered[LAYOUT_TYPES];
    int64_t before[N_SPECIES];  /* rows of each species in the groups so far */
};

struct group { struct reader *reader; struct species *table; int type; struct part part; };

/* Spellings met in files of GADGET, AREPO, GIZMO and SWIFT; the first is the column's own. */
static const char *const spellings[][3] = {
    {"Coordinates", "Coordinate", "Positions"}, {"Velocities", "Velocity", NULL},
    {"Masses", "Mass", NULL},                   {"ParticleIDs", "ParticleID", NULL},
    {"InternalEnergy", "InternalEnergies", NULL}, {"SmoothingLength", "SmoothingLengths", NULL},
    {"Density", "Densities", NULL},             {"Potential", "Potentials", NULL},
    {"Acceleration", "Accelerations", NULL},    {"Temperature", "Temperatures", NULL},
    {"OxygenFraction", "Oxygen", NULL},         {"IronFraction", "Iron", NULL},
};
enum { N_SPELLINGS = sizeof spellings / sizeof *spellings };

/* SWIFT's h times this is the support's radius H of the cubic spline (Dehnen & Aly 2012, table 1). */
static const double swift_support = 1.825742;

/* --- header --- */

/* The file's units in cgs; false if it names none. */
static bool named_units(struct reader *r)
{
    static const char *const gadget[3] = {"UnitLength_in_cm", "UnitMass_in_g", "UnitVelocity_in_cm_per_s"};
    static const char *const swift[3] = {"Unit length in cgs (U_L)", "Unit mass in cgs (U_M)",
                                         "Unit time in cgs (U_t)"};
    double v[3];
    bool named = true;
    r->swift = true;
    for (int k = 0; k < 3; k++) r->swift = r->swift && start_header_number(r->file, swift[k], &v[k]);
    if (r->swift) v[2] = v[0] / v[2];
    for (int k = 0; k < 3 && !r->swift; k++) named = named && start_header_number(r->file, gadget[k], &v[k]);
    for (int k = 0; k < 3 && named; k++)
        if (!(isfinite(v[k]) && v[k] > 0)) {
            problems_add(&r->sim->problems, "%s: its unit of %s is %g in cgs: must be above 0", r->path,
                         k == 0 ? "length" : k == 1 ? "mass" : r->swift ? "length over time" : "velocity", v[k]);
            return false;
        }
    if (named) r->unit = (struct layout_unit){v[0], v[1], v[2], "named"};
    return named;
}

static void read_units(struct reader *r)
{
    const struct units *code = &r->sim->units;
    bool named = named_units(r);
    char *text = h5_read_attr_text(r->file, "Units", "units");
    const bool none = text && strcmp(text, "none") == 0;
    mem_free(text);
    if (!code->physical) {
        if (named && !none && (r->unit.length != 1 || r->unit.mass != 1 || r->unit.velocity != 1))
            log_warning("%s has units (%g cm, %g g, %g cm/s), but the scene has none: its numbers are taken as they are, with "
                        "G = %g", r->path, r->unit.length, r->unit.mass, r->unit.velocity, code->G);
        r->unit = layout_unit(false);
        return;
    }
    if (none)
        problems_add(&r->sim->problems, "%s is dimensionless (units = none), but the scene has physical units; "
                     "a scene with units: {G: 1} can start from it", r->path);
    if (!named) {
        r->unit = layout_unit(true);
        log_warning("%s names no units: taken to be %s", r->path, r->unit.name);
    }
    r->unit.length /= code->length;
    r->unit.mass /= code->mass;
    r->unit.velocity /= code->velocity;
}

static double file_factor(const struct reader *r, const char *unit)
{
    int power[3];
    layout_powers(unit, power);
    return layout_cgs(&r->unit, power);
}

/* BoxSize is one number or three. */
static void read_box(struct reader *r)
{
    double size[3], side[3];
    if (!box_awaits_file(r->sim)) return;
    bool three = h5_read_attr(r->file, "Header", "BoxSize", size, 3);
    if (!three && !h5_read_attr(r->file, "Header", "BoxSize", size, 1)) return;
    const double factor = file_factor(r, "L") * start_cosmology_factor(&r->cosmology, r->file, NULL, "L");
    for (int k = 0; k < 3; k++) side[k] = size[three ? k : 0] * factor;
    box_from_file(r->sim, side);
}

static void read_header(struct reader *r)
{
    double files = 1;
    if (!h5_exists(r->file, "Header")) {
        problems_add(&r->sim->problems, "%s has no group Header: not a snapshot of GADGET's kind", r->path);
        return;
    }
    h5_read_attr(r->file, "Header", "NumFilesPerSnapshot", &files, 1);
    if (files > 1)
        problems_add(&r->sim->problems, "%s is one of %g files of a snapshot: join them first", r->path, files);
    h5_read_attr(r->file, "Header", "MassTable", r->mass_table, LAYOUT_TYPES);
    for (int t = 0; t < LAYOUT_TYPES; t++) r->count[t] = -1;
    h5_read_attr(r->file, "Header", "NumPart_ThisFile", r->count, LAYOUT_TYPES);
    r->cosmology = start_cosmology_read(r->sim, r->file, r->path);
    read_units(r);
    double start = 0, factor = file_factor(r, "L V^-1") / r->cosmology.h;
    if (!r->cosmology.comoving && h5_read_attr(r->file, "Header", "Time", &start, 1)) r->sim->time.start = start * factor;
    if (!isfinite(start))
        problems_add(&r->sim->problems, "%s: its Time is %g: correct the attribute of its Header", r->path, start);
    read_box(r);
    if (start != 0) log_line("%s: the run starts at the file's time, %g", r->path, r->sim->time.start);
}

/* --- groups and data sets --- */

/* N_SPECIES: its attribute `species` names none that there is. */
static int group_species(struct h5 *file, const char *group, int type)
{
    static const enum species_kind usual[LAYOUT_TYPES] = {GAS, DARK, STAR, STAR, STAR, STAR};
    char *text = h5_read_attr_text(file, group, "species");
    int kind = text ? 0 : (int)usual[type];
    while (text && kind < N_SPECIES && strcmp(text, species_names[kind]) != 0) kind++;
    mem_free(text);
    return kind;
}

/* The path of a data set under whichever name it has; false if there is none. */
static bool find(const struct group *g, const char *name, char path[100])
{
    for (int i = 0; i < N_SPELLINGS; i++)
        for (int j = 0; strcmp(spellings[i][0], name) == 0 && j < 3 && spellings[i][j]; j++) {
            snprintf(path, 100, "PartType%d/%s", g->type, spellings[i][j]);
            if (h5_exists(g->reader->file, path)) return true;
        }
    snprintf(path, 100, "PartType%d/%s", g->type, name);
    return h5_exists(g->reader->file, path);
}

/* Data sets that the run does not use are named, and no more. */
static void note_unused(const char *name, void *context)
{
    const struct group *g = context;
    for (int i = 0; i < N_SPELLINGS; i++)
        for (int j = 0; j < 3 && spellings[i][j]; j++)
            if (strcmp(name, spellings[i][j]) == 0) return;
    for (int c = 0; c < N_COLUMNS; c++)
        if (species_has(g->table, c) && strcmp(name, column_table[c].file_name) == 0) return;
    log_line("%s: PartType%d/%s is not used", g->reader->path, g->type, name);
}

/* Columns that a start can give. */
static bool is_read(int column)
{
    return *column_table[column].file_name && column_table[column].lifetime == KEEP && column != COLUMN_acc;
}

static struct h5_part part_of(const struct group *g) { return (struct h5_part){g->part.all, g->part.skip, g->part.n}; }

static void read_column(const struct group *g, enum column column)
{
    const struct column_info *info = &column_table[column];
    const struct reader *r = g->reader;
    char path[100];
    if (!find(g, info->file_name, path)) return;
    const char in_file = h5_kind(r->file, path);
    if (column == COLUMN_id && (in_file == 'f' || in_file == 'd')) {
        problems_add(&r->sim->problems, "%s: PartType%d/%s are not whole numbers but %s, which do not hold every id: write them as "
                     "integers of 64 bits", r->path, g->type, strchr(path, '/') + 1, in_file == 'f' ? "floats" : "doubles");
        return;
    }
    char *values = (char *)species_column(g->table, column) + (size_t)g->part.first * species_row_bytes(column);
    double factor = column_is_element(column) ? 1
                  : file_factor(r, info->unit) * start_cosmology_factor(&r->cosmology, r->file, path, info->unit);
    if (column == COLUMN_birth && r->cosmology.comoving) {
        log_warning("%s: PartType%d/%s holds scale factors, which are not read: its stars count as born at time 0", r->path,
                    g->type, info->file_name);
        return;
    }
    if (column == COLUMN_h) factor *= r->swift ? swift_support / 2 : 0.5;
    if (h5_read_rows(r->file, path, info->element_bytes == 1 ? 'b' : info->kind, part_of(g), info->components, values))
        layout_scale(info->kind, values, g->part.n * info->components, factor);
}

/* What a file may give in another way: masses in the header, ids not at all, u as a temperature. */
static void fill_missing(const struct group *g)
{
    struct reader *r = g->reader;
    struct species *table = g->table;
    char path[100];
    double mass = r->mass_table[g->type] * r->unit.mass * start_cosmology_factor(&r->cosmology, r->file, NULL, "M");
    double kelvin = layout_kelvin(r->sim);
    const int64_t first = g->part.first, end = first + g->part.n;
    if (!find(g, "Masses", path)) {
        if (mass == 0)
            problems_add(&r->sim->problems, "%s: PartType%d has neither Masses nor an entry in MassTable",
                         r->path, g->type);
        for (int64_t i = first; i < end; i++) table->mass[i] = mass;
    }
    for (int c = FIRST_ELEMENT; c < END_ELEMENTS; c++) {    /* fractions become masses */
        double *element = species_column(table, c);
        for (int64_t i = first; element && i < end; i++) element[i] *= table->mass[i];
    }
    if (!find(g, "ParticleIDs", path)) {
        log_line("%s: PartType%d has no ParticleIDs: numbered in the file's order", r->path, g->type);
        r->unnumbered[g->type] = (struct unnumbered){table, g->part};
    }
    if (!find(g, "Velocities", path))
        log_line("%s: PartType%d has no Velocities: at rest", r->path, g->type);
    if (g->type == LAYOUT_HOLES && table->hole && !find(g, "BlackHole", path) && !find(g, "Sink", path))
        memset(table->hole + first, 1, (size_t)g->part.n);
    if (table->kind != GAS || !table->u || find(g, "InternalEnergy", path)) return;
    float *u = table->u + first;
    if (kelvin == 0 || !find(g, "Temperature", path))
        problems_add(&r->sim->problems, "%s: PartType%d has no InternalEnergy%s", r->path, g->type,
                     kelvin == 0 ? "" : " and no Temperature");
    else if (h5_read_rows(r->file, path, 'f', part_of(g), 1, u)) {
        for (int64_t i = 0; i < g->part.n; i++) u[i] = (float)((double)u[i] / kelvin);
        r->with_kelvin += g->part.all;
    }
}

/* Room for the rows of a group, and which of them are read here. */
static void make_room(struct group *g)
{
    struct species *table = g->table;
    struct part *part = &g->part;
    int64_t *before = &g->reader->before[table->kind];
    if (g->reader->sim->spread) {
        const int64_t from = *before > table->own ? *before : table->own, own_end = table->own + table->n_own;
        const int64_t end = *before + part->all < own_end ? *before + part->all : own_end;
        part->n = end > from ? end - from : 0;
        part->first = part->n > 0 ? from : table->own;
        part->skip = part->n > 0 ? from - *before : 0;
    } else {
        part->first = table->n;
        part->n = part->all;
        species_reserve(table, table->n + part->n);
        table->n = table->n_own = table->n + part->n;
    }
    *before += part->all;
}

static void read_group(struct reader *r, int type)
{
    char path[100];
    int components = 0;
    struct group g = {.reader = r, .type = type};
    snprintf(path, sizeof path, "PartType%d", type);
    const int kind = group_species(r->file, path, type);
    if (kind == N_SPECIES) {
        char *text = h5_read_attr_text(r->file, path, "species");
        problems_add(&r->sim->problems, "%s: PartType%d has species = \"%s\": gas, cloud, star or dark", r->path, type, text);
        mem_free(text);
        return;
    }
    g.table = &r->sim->species[kind];
    bool there = find(&g, "Coordinates", path);
    if (!there || !h5_shape(r->file, path, &g.part.all, &components)) {
        problems_add(&r->sim->problems, "%s: PartType%d has %s", r->path, type,
                     there ? "Coordinates that are not a table of rows" : "no Coordinates");
        return;
    }
    if (r->count[type] >= 0 && r->count[type] != (double)g.part.all)
        problems_add(&r->sim->problems, "%s: Header promises %.0f rows of PartType%d, Coordinates has %" PRId64
                     ": the file is not whole; write it anew", r->path, r->count[type], type, g.part.all);
    int64_t total = g.part.all;
    for_species(r->sim, s) total += r->sim->spread ? 0 : s->n;
    if (total > INT32_MAX) {
        problems_add(&r->sim->problems, "%s holds more than the %d rows that a rank can have", r->path, INT32_MAX);
        return;
    }
    make_room(&g);
    for (int c = 0; c < N_COLUMNS; c++)
        if (is_read(c) && species_has(g.table, c)) read_column(&g, c);
    for (int64_t i = g.part.first; i < g.part.first + g.part.n; i++) g.table->id[i] += r->shift;
    fill_missing(&g);
    snprintf(path, sizeof path, "PartType%d", type);
    h5_list(r->file, path, note_unused, &g);
    log_line("%s: %" PRId64 " rows of PartType%d are %s", r->path, g.part.all, type, species_names[g.table->kind]);
}

/* Of spread rows each rank reads an equal part of every species, in the file's order. */
static void share_out(struct reader *r)
{
    int64_t rows[N_SPECIES] = {0};
    const int64_t size = comm_size(), rank = comm_rank();
    for (int t = 0; t < LAYOUT_TYPES; t++) {
        char path[100];
        int64_t all;
        int components;
        struct group g = {.reader = r, .type = t};
        snprintf(path, sizeof path, "PartType%d", t);
        if (!h5_exists(r->file, path)) continue;
        const int kind = group_species(r->file, path, t);
        if (kind < N_SPECIES && find(&g, "Coordinates", path) && h5_shape(r->file, path, &all, &components)) rows[kind] += all;
    }
    for (int s = 0; s < N_SPECIES; s++) {
        const int64_t from = rows[s] * rank / size;
        if (rows[s] > 0) species_reserve_part(&r->sim->species[s], rows[s], from, rows[s] * (rank + 1) / size - from);
    }
}

/* Rows without ids get the numbers after the largest that the file gives, in the file's order. */
static void number_rows(struct reader *r)
{
    uint64_t last = 0;
    int64_t *of_rank = mem_array("files", int64_t, comm_size());
    for_species(r->sim, table)
        for (int64_t i = species_from(table); i < species_to(table); i++) last = table->id[i] > last ? table->id[i] : last;
    if (r->sim->spread) comm_gather_counts((int64_t)last, of_rank);
    for (int k = 0; k < comm_size() && r->sim->spread; k++) last = (uint64_t)of_rank[k] > last ? (uint64_t)of_rank[k] : last;
    for (int t = 0; t < LAYOUT_TYPES; t++) {
        const struct unnumbered *u = &r->unnumbered[t];
        for (int64_t i = 0; i < u->part.n; i++) u->table->id[u->part.first + i] = last + 1 + (uint64_t)(u->part.skip + i);
        last += (uint64_t)u->part.all;
    }
    mem_free(of_rank);
}

void start_file_need_all(struct sim *sim, const char *path)
{
    struct reader reader = {.sim = sim, .path = path, .file = formats_open(path)};
    for (int t = 0; t < LAYOUT_TYPES && !h5_error(reader.file); t++) {
        char text[100];
        struct group g = {.reader = &reader, .type = t};
        snprintf(text, sizeof text, "PartType%d", t);
        if (!h5_exists(reader.file, text)) continue;
        const int kind = group_species(reader.file, text, t);
        if (kind == N_SPECIES) continue;    /* told where it is read */
        g.table = &sim->species[kind];
        for (int c = 0; c < N_COLUMNS; c++)
            if (is_read(c) && find(&g, column_table[c].file_name, text)) species_need(g.table, (enum column)c);
        if (t == LAYOUT_HOLES && !find(&g, "Sink", text)) species_need(g.table, COLUMN_hole);
    }
    h5_close(reader.file);
}

void start_file_read(struct sim *sim, const char *path) { start_file_add(sim, path, 0); }

void start_file_add(struct sim *sim, const char *path, uint64_t shift)
{
    struct reader reader = {.sim = sim, .path = path, .file = formats_open(path), .unit = layout_unit(false), .shift = shift};
    reader.with_kelvin = sim->kelvin ? sim->species[GAS].n : 0;
    int64_t rows = 0;
    int problems = sim->problems.count;
    char *wrong = NULL;
    static const enum column always[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id};
    for (int s = 0; s < N_SPECIES; s++)
        for (int i = 0; i < 4; i++) species_need(&sim->species[s], always[i]);
    if (!h5_error(reader.file) && h5_exists(reader.file, "Checkpoint"))
        problems_add(&sim->problems, "%s is a checkpoint of tephra, no snapshot: tephra run --restart DIR goes on from it, DIR "
                     "being the run's directory; a start needs one of its snapshots", path);
    else if (!h5_error(reader.file)) read_header(&reader);
    if (!h5_error(reader.file) && sim->spread) share_out(&reader);
    for (int t = 0; t < LAYOUT_TYPES && sim->problems.count == problems; t++) {
        char group[20];
        snprintf(group, sizeof group, "PartType%d", t);
        if (h5_exists(reader.file, group)) read_group(&reader, t);
        else if (reader.count[t] > 0)
            problems_add(&sim->problems, "%s: Header promises %.0f rows of PartType%d, and there is no such group: "
                         "the file is not whole; write it anew", path, reader.count[t], t);
    }
    for_species(sim, table) rows += table->n;
    if (h5_error(reader.file)) wrong = mem_format("messages", "%s %s", path, h5_error(reader.file));
    ranks_tell(sim, wrong);
    mem_free(wrong);
    if (rows == 0 && sim->problems.count == problems)
        problems_add(&sim->problems, "%s holds no particles", path);
    if (sim->problems.count == problems) {
        number_rows(&reader);
        start_check_rows(&(struct start_rows){sim, path, reader.with_kelvin});
    }
    sim->kelvin = reader.with_kelvin > 0;
    h5_close(reader.file);
}
