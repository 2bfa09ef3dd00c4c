/* SPDX-License-Identifier: GPL-3.0-or-later
 * Writes snapshots (snapshot.h). The layout is GADGET-4's, with attributes that its readers know:
 * GADGET-4's scalings for each data set, the older VarDescription and CGSConversionFactor that
 * pynbody reads, and plain `units` and `description` for people. */
#include "snapshot.h"
#include "comm.h"
#include "h5.h"
#include "layout.h"
#include "mem.h"
#include "provenance.h"
#include "slices.h"
#include <stdio.h>
#include <string.h>

/* Positions and velocities now of rows that are in the midst of their step. */
static void predict(const struct sim *sim, const struct species *table, enum column column,
                    const struct slices *rows, double (*values)[3])
{
    bool moving = table->rung && table->rung0 && table->acc && !timeline_synchronous(&sim->time);
    for (int64_t i = 0; moving && i < rows->n_here; i++) {
        int32_t row = rows->order[i];
        double lag = timeline_lag(&sim->time, table->rung[row], table->rung0[row]);
        if (column == COLUMN_pos) sim_predict(&sim->time, table, row, values[i]);
        else for (int k = 0; k < 3; k++) values[i][k] += lag * (double)table->acc[row][k];
    }
}

/* The attributes of a data set. unit: in powers of L, M, V, or "K". */
static void describe(struct h5 *file, const char *path, bool physical, const char *unit, const char *text)
{
    struct layout_unit file_unit = layout_unit(physical);
    int power[3];
    char units[80], gadget[80];
    layout_powers(unit, power);
    layout_unit_text(physical, unit, units, sizeof units);
    /* pynbody finds a power only before one more character, hence the space at the end. */
    snprintf(gadget, sizeof gadget, "U_L^%d U_M^%d U_V^%d ", power[0], power[1], power[2]);
    const struct { const char *name; double value; } number[] = {
        {"a_scaling", 0}, {"h_scaling", 0}, {"aexp-scale-exponent", 0}, {"h-scale-exponent", 0},
        {"length_scaling", power[0]}, {"mass_scaling", power[1]}, {"velocity_scaling", power[2]},
        {"to_cgs", layout_cgs(&file_unit, power)}, {"CGSConversionFactor", layout_cgs(&file_unit, power)},
    };
    for (size_t i = 0; i < sizeof number / sizeof *number; i++)
        h5_attr_double(file, path, number[i].name, number[i].value);
    h5_attr_text(file, path, "VarDescription", gadget);
    h5_attr_text(file, path, "units", units);
    h5_attr_text(file, path, "description", text);
}

/* Doubles to floats, in place. */
static void narrow(void *values, int64_t count)
{
    for (int64_t i = 0; i < count; i++) {
        float value = (float)((const double *)values)[i];
        memcpy((char *)values + (size_t)i * sizeof value, &value, sizeof value);
    }
}

/* What all data sets of a snapshot share. file: the first rank's; NULL on others, which bring in their rows alone. */
struct writer { struct h5 *file; const struct sim *sim; enum snapshot_precision precision; int64_t count[LAYOUT_TYPES]; };

/* The rows of a table that are of one PartType. */
struct part { const struct species *table; int type; struct slices rows; };

static void write_column(const struct writer *w, const struct part *part, enum column column)
{
    const struct sim *sim = w->sim;
    const struct species *table = part->table;
    const struct column_info *info = &column_table[column];
    const int64_t n = part->rows.n_here;
    const int32_t *order = part->rows.order;
    bool twice = column == COLUMN_h;
    const char *unit = column_is_element(column) ? "1" : info->unit;
    const char *text = twice ? "radius of the kernel's support, twice the smoothing length" : info->text;
    char path[100];
    char kind = info->element_bytes == 1 ? 'b' : info->kind;
    void *values = mem_alloc("files", (size_t)n * species_row_bytes(column));
    species_gather(species_row_bytes(column), species_column(table, column), values, order, n);
    if (column == COLUMN_pos || column == COLUMN_vel) predict(sim, table, column, &part->rows, values);
    if (column == COLUMN_pos)
        for (int64_t i = 0; i < n; i++) box_wrap(&sim->box, (double *)values + 3 * i);
    if (column_is_element(column))
        for (int64_t i = 0; i < n; i++) ((double *)values)[i] /= table->mass[order[i]];
    layout_scale(kind, values, n * info->components, layout_factor(&sim->units, unit) * (twice ? 2 : 1));
    snprintf(path, sizeof path, "PartType%d/%s", part->type, info->file_name);
    if (kind == 'd' && w->precision == SNAPSHOT_FLOAT) {
        narrow(values, n * info->components);
        kind = 'f';
    }
    slices_write_by_id(&part->rows, &(struct slices_set){w->file, path, kind, info->components}, values);
    if (w->file) describe(w->file, path, sim->units.physical, unit, text);
}

static void write_temperature(const struct writer *w, const struct part *part)
{
    const struct species *table = part->table;
    if (table->kind != GAS) return;
    char path[100];
    const int64_t from = species_from(table);
    float *kelvin = mem_array("files", float, species_to(table) - from), *values = mem_array("files", float, part->rows.n_here);
    if (layout_temperatures(w->sim, kelvin)) {
        for (int64_t i = 0; i < part->rows.n_here; i++) values[i] = kelvin[part->rows.order[i] - from];
        snprintf(path, sizeof path, "PartType%d/Temperature", part->type);
        slices_write_by_id(&part->rows, &(struct slices_set){w->file, path, 'f', 1}, values);
        if (w->file) describe(w->file, path, true, "K", "temperature, P/rho mu m_p / k_B");
    } else {
        mem_free(values);
    }
    mem_free(kelvin);
}

static void write_part(const struct writer *w, const struct species *table, int type)
{
    char group[20];
    if (w->count[type] == 0) return;
    snprintf(group, sizeof group, "PartType%d", type);
    if (w->file) h5_group(w->file, group);
    if (w->file) h5_attr_text(w->file, group, "species", species_names[table->kind]);
    struct part part = {table, type, slices_by_id(w->sim, table, type)};
    for (int c = 0; c < N_COLUMNS; c++) {
        bool stale = c == COLUMN_pot && !w->sim->fresh_potential;
        if (*column_table[c].file_name && !stale && species_column(table, c) && layout_holds(type, (enum column)c))
            write_column(w, &part, (enum column)c);
    }
    write_temperature(w, &part);
    slices_free(&part.rows);
}

/* Rows of each PartType, of all ranks. */
static void count_rows(struct writer *w)
{
    for (int s = 0; s < N_SPECIES; s++) {
        const struct species *table = &w->sim->species[s];
        const int64_t from = w->sim->spread ? table->own : 0, end = w->sim->spread ? table->own + table->n_own : table->n;
        for (int64_t i = from; i < end; i++)
            if (!species_gone(table, i)) w->count[layout_type_of(table, i)]++;
    }
    if (w->sim->spread) comm_sum_int(w->count, LAYOUT_TYPES);
}

static void write_units(struct h5 *file, const struct sim *sim, const char *group)
{
    struct layout_unit unit = layout_unit(sim->units.physical);
    h5_attr_double(file, group, "UnitLength_in_cm", unit.length);
    h5_attr_double(file, group, "UnitMass_in_g", unit.mass);
    h5_attr_double(file, group, "UnitVelocity_in_cm_per_s", unit.velocity);
    h5_attr_double(file, group, "UnitTime_in_s", unit.length / unit.velocity);
    h5_attr_text(file, group, "units", unit.name);
}

/* One number for a cube and for open space, else the three sides. */
static void write_box(struct h5 *file, const struct sim *sim)
{
    double side[3];
    for (int k = 0; k < 3; k++) side[k] = sim->box.side[k] * layout_factor(&sim->units, "L");
    if (box_closed(&sim->box) && !box_cubic(&sim->box)) h5_attr_doubles(file, "Header", "BoxSize", side, 3);
    else h5_attr_double(file, "Header", "BoxSize", side[0]);
}

static void write_header(const struct writer *w)
{
    struct h5 *file = w->file;
    const struct sim *sim = w->sim;
    uint64_t count[LAYOUT_TYPES] = {0};
    const uint64_t zero[LAYOUT_TYPES] = {0};
    const double no_mass[LAYOUT_TYPES] = {0};
    static const char *const names[] = {"NumPart_ThisFile", "NumPart_Total"};
    static const char *const flags[] = {"Flag_Sfr", "Flag_Cooling", "Flag_StellarAge", "Flag_Metals",
                                        "Flag_Feedback"};
    for (int t = 0; t < LAYOUT_TYPES; t++) count[t] = (uint64_t)w->count[t];
    double now = timeline_now(&sim->time);
    h5_group(file, "Header");
    for (int i = 0; i < 2; i++) h5_attr_uints(file, "Header", names[i], count, LAYOUT_TYPES);
    h5_attr_uints(file, "Header", "NumPart_Total_HighWord", zero, LAYOUT_TYPES);
    h5_attr_doubles(file, "Header", "MassTable", no_mass, LAYOUT_TYPES);
    h5_attr_double(file, "Header", "Time", now * layout_factor(&sim->units, "L V^-1"));
    h5_attr_double(file, "Header", "Time_GYR", layout_gyr(&sim->units, now));
    h5_attr_double(file, "Header", "Redshift", 0);
    write_box(file, sim);
    h5_attr_int(file, "Header", "NumFilesPerSnapshot", 1);
    h5_attr_int(file, "Header", "Flag_DoublePrecision", w->precision == SNAPSHOT_DOUBLE);
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++) h5_attr_int(file, "Header", flags[i], 0);
    write_units(file, sim, "Header");
}

/* The scene as it was given, key by key, beside what pynbody looks for here. */
static void write_parameters(struct h5 *file, const struct sim *sim)
{
    h5_group(file, "Parameters");
    write_units(file, sim, "Parameters");
    h5_attr_double(file, "Parameters", "Time_GYR", layout_gyr(&sim->units, timeline_now(&sim->time)));
    for (int b = 0; sim->scene && b < sim->scene->n; b++) {
        const struct scene_block *block = &sim->scene->block[b];
        for (int e = 0; e < block->n; e++) {
            char name[200];
            snprintf(name, sizeof name, "%s.%s", block->name, block->entry[e].key);
            h5_attr_text(file, "Parameters", name, block->entry[e].value);
        }
    }
}

/* All but the rows. */
static void write_head(const struct writer *w)
{
    write_header(w);
    write_parameters(w->file, w->sim);
    h5_group(w->file, "Units");
    write_units(w->file, w->sim, "Units");
    provenance_write(w->file, w->sim);
}

void snapshot_write(const struct sim *sim, const char *path, enum snapshot_precision precision)
{
    const bool first = comm_rank() == 0;
    if (!first && !sim->spread) return;
    struct writer writer = {.file = first ? h5_create(path) : NULL, .sim = sim, .precision = precision};
    count_rows(&writer);
    if (first) write_head(&writer);
    for (int s = 0; s < N_SPECIES; s++) write_part(&writer, &sim->species[s], layout_type[s]);
    write_part(&writer, &sim->species[STAR], LAYOUT_HOLES);
    if (first) h5_close(writer.file);
}
