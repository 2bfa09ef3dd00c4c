/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where each column of each table is up to date. */
#include "device_rows.h"
#include "device.h"
#include "mem.h"
#include "sim.h"

/* Of one table. here, there: bits of the columns that are up to date on the host, on the device. */
struct copies {
    struct device *device;
    uint64_t here, there;
    int64_t room;               /* rows */
    void *at[N_COLUMNS];
    void *spare;                /* a column of the widest kind, for reorders and between them for whoever asks */
    int32_t *list, *order;
    bool listed;                /* the list is the host's */
    struct rows_crossed crossed;
};

bool rows_are_here(const struct species *table, enum column column)
{
    return !table->copies || table->copies->here >> column & 1;
}

bool rows_are_there(const struct species *table, uint64_t columns)
{
    return table->copies && (columns & table->columns & ~table->copies->there) == 0;
}

static void cross(struct species *table, enum column column, bool home)
{
    struct copies *copies = table->copies;
    const size_t bytes = (size_t)table->n * species_row_bytes(column);
    if (home) device_download(copies->device, *species_slot(table, column), copies->at[column], bytes);
    else device_upload(copies->device, copies->at[column], *species_slot(table, column), bytes);
    copies->crossed.columns++;
    copies->crossed.bytes += (int64_t)bytes;
}

static void bring_here(struct species *table, uint64_t columns)
{
    struct copies *copies = table->copies;
    for (int c = 0; c < N_COLUMNS; c++)
        if (columns & table->columns & ~copies->here & (uint64_t)1 << c) cross(table, (enum column)c, true);
    copies->here |= columns & table->columns;
}

void rows_here(struct sim *sim, unsigned mask, uint64_t read, uint64_t write)
{
    for (struct species *s = sim->species; s < sim->species + N_SPECIES; s++) {
        if (!s->copies || !(mask >> s->kind & 1)) continue;
        bring_here(s, read | write);
        s->copies->there &= ~write;
    }
}

static void *room(struct copies *copies, size_t bytes) { return device_alloc(copies->device, "rows", bytes); }

/* For as many rows as the host has addresses. */
static struct copies *copies_of(struct sim *sim, struct species *table)
{
    check(!table->spread);
    if (table->copies) return table->copies;
    struct copies *copies = mem_alloc("columns", sizeof *copies);
    *copies = (struct copies){.device = sim->device, .here = table->columns, .room = table->capacity};
    copies->list = room(copies, (size_t)copies->room * sizeof *copies->list);
    return table->copies = copies;
}

/* The lists of rows whose step ends: of all rows, in order, they are not needed. */
static void send_list(const struct species *table, struct copies *copies)
{
    if (!copies->listed && table->n_ending < table->n)
        device_upload(copies->device, copies->list, table->ending, (size_t)table->n_ending * sizeof *copies->list);
    copies->listed = true;
}

struct species rows_there(struct sim *sim, enum species_kind kind, uint64_t read, uint64_t write)
{
    struct species *table = &sim->species[kind], view = *table;
    struct copies *copies = copies_of(sim, table);
    const uint64_t columns = (read | write) & table->columns;
    check(table->n <= copies->room);
    for (int c = 0; c < N_COLUMNS; c++) {
        *species_slot(&view, (enum column)c) = NULL;
        if (!(columns >> c & 1)) continue;
        if (!copies->at[c]) copies->at[c] = room(copies, (size_t)copies->room * species_row_bytes((enum column)c));
        if (!(copies->there >> c & 1)) cross(table, (enum column)c, false);
        *species_slot(&view, (enum column)c) = copies->at[c];
    }
    send_list(table, copies);
    view.ending = table->n_ending < table->n ? copies->list : NULL;
    view.active = view.ending ? copies->list + (table->active - table->ending) : NULL;
    view.copies = NULL;
    if (!device_sound(copies->device)) return view;
    copies->there |= columns;
    copies->here &= ~write;
    return view;
}

struct rows_crossed rows_crossed(const struct sim *sim)
{
    struct rows_crossed sum = {0, 0};
    for (const struct species *s = sim->species; s < sim->species + N_SPECIES; s++) {
        if (!s->copies) continue;
        sum.columns += s->copies->crossed.columns;
        sum.bytes += s->copies->crossed.bytes;
    }
    return sum;
}

void rows_listed(struct species *table)
{
    if (table->copies) table->copies->listed = false;
}

static void *reserve_spare(const struct species *table)
{
    struct copies *copies = table->copies;
    if (!copies->spare) copies->spare = room(copies, (size_t)copies->room * species_widest(table));
    return copies->spare;
}

void *rows_scratch(struct sim *sim, enum species_kind kind)
{
    copies_of(sim, &sim->species[kind]);
    return reserve_spare(&sim->species[kind]);
}

/* Each column goes into the spare one and, but for the widest, which change places with it, back. */
void rows_permute(struct species *table, const int32_t *order, int64_t n)
{
    struct copies *copies = table->copies;
    if (!copies) return;
    const size_t widest = species_widest(table);
    reserve_spare(table);
    if (!copies->order) copies->order = room(copies, (size_t)copies->room * sizeof *copies->order);
    device_upload(copies->device, copies->order, order, (size_t)n * sizeof *order);
    for (int c = 0; c < N_COLUMNS; c++) {
        const size_t row = species_row_bytes((enum column)c);
        if (!(copies->there >> c & 1) || column_table[c].lifetime != KEEP) continue;
        device_gather(copies->device, copies->spare, copies->at[c], copies->order, n, row);
        if (row == widest) {
            void *old = copies->at[c];
            copies->at[c] = copies->spare;
            copies->spare = old;
        } else {
            device_copy(copies->device, copies->at[c], copies->spare, (size_t)n * row);
        }
    }
}

void rows_discard(struct species *table)
{
    struct copies *copies = table->copies;
    if (!copies) return;
    for (int c = 0; c < N_COLUMNS; c++) device_free(copies->device, copies->at[c]);
    device_free(copies->device, copies->spare);
    device_free(copies->device, copies->order);
    device_free(copies->device, copies->list);
    mem_free(copies);
    table->copies = NULL;
}

void rows_leave(struct species *table)
{
    if (table->copies) bring_here(table, table->columns);
    rows_discard(table);
}
