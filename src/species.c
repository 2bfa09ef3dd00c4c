/* SPDX-License-Identifier: GPL-3.0-or-later
 * Tables of the four species: columns on demand. */
#include "species.h"
#include "device_rows.h"
#include "fail.h"
#include "mem.h"
#include <string.h>

const char *const species_names[N_SPECIES] = {"gas", "cloud", "star", "dark"};

#define KIND(type) _Generic((type)0, double: 'd', float: 'f', default: 'u')
#define COLUMN(field, type, dims, lifetime, unit, file, text) \
    {#field, sizeof(type), (int)(sizeof(*((struct species *)0)->field) / sizeof(type)), KIND(type), \
     lifetime, unit, file, text},
const struct column_info column_table[N_COLUMNS] = {SPECIES_COLUMNS(COLUMN)};
#undef COLUMN

#define NODE(field, type, dims, unit, text) {#field, sizeof(type), unit, text},
const struct node_column_info node_column_table[N_NODE_COLUMNS] = {NODE_COLUMNS(NODE)};
#undef NODE

void **species_slot(const struct species *table, enum column column)
{
    static const size_t offset[N_COLUMNS] = {
#define COLUMN(field, ...) offsetof(struct species, field),
        SPECIES_COLUMNS(COLUMN)
#undef COLUMN
    };
    return (void **)((char *)table + offset[column]);
}

void species_need(struct species *table, enum column column)
{
    table->columns |= (uint64_t)1 << column;
}

void *species_column(const struct species *table, enum column column)
{
    return *species_slot(table, column);
}

size_t species_row_bytes(enum column column)
{
    return (size_t)(column_table[column].element_bytes * column_table[column].components);
}

/* A column of a spread table, with room for the own rows. */
static void *reserve_part(const struct species *table, size_t row)
{
    void *part = mem_reserve("columns", (size_t)table->n * row);
    mem_use(part, (size_t)table->own * row, (size_t)(table->own + table->n_own) * row);
    return part;
}

static void refuse_too_many(const struct species *table, int64_t rows)
{
    if (rows > INT32_MAX)
        fail(STATUS_INPUT, "%lld %s rows: at most 2^31 - 1 of a species", (long long)rows, species_names[table->kind]);
}

void species_reserve_part(struct species *table, int64_t n, int64_t own, int64_t n_own)
{
    refuse_too_many(table, n);
    table->spread = true;
    table->n = table->capacity = n;
    table->own = own;
    table->n_own = n_own;
    for (int c = 0; c < N_COLUMNS; c++)
        if (species_has(table, c)) *species_slot(table, c) = reserve_part(table, species_row_bytes(c));
    table->ending = table->active = mem_array("columns", int32_t, n_own + 1);
}

void species_join(struct species *table)
{
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!species_has(table, c)) continue;
        const size_t bytes = (size_t)table->n * species_row_bytes(c);
        void *part = *species_slot(table, c), *whole = mem_alloc("columns", bytes);
        memcpy(whole, part, bytes);
        mem_free(part);
        *species_slot(table, c) = whole;
    }
    table->spread = false;
    table->own = 0;
    table->n_own = table->n;
    table->ending = table->active = mem_resize("columns", table->ending, (size_t)table->n * sizeof *table->ending);
}

void species_reserve(struct species *table, int64_t capacity)
{
    refuse_too_many(table, capacity);
    if (capacity < table->capacity) capacity = table->capacity;
    if (capacity > table->capacity) rows_leave(table);
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!species_has(table, c)) continue;
        void **data = species_slot(table, c);
        size_t row = species_row_bytes(c);
        int64_t kept = *data ? table->n : 0;
        if (capacity == 0 || (*data && capacity == table->capacity)) continue;
        if (table->spread) {
            *data = reserve_part(table, row);
            continue;
        }
        *data = mem_resize("columns", *data, (size_t)capacity * row);
        memset((char *)*data + (size_t)kept * row, 0, (size_t)(capacity - kept) * row);
    }
    if (capacity > table->capacity || !table->ending)
        table->ending = mem_resize("columns", table->ending, (size_t)capacity * sizeof *table->ending);
    table->active = table->ending;
    table->capacity = capacity;
}

void species_free(struct species *table)
{
    rows_discard(table);
    for (int c = 0; c < N_COLUMNS; c++) {
        mem_free(*species_slot(table, c));
        *species_slot(table, c) = NULL;
    }
    mem_free(table->ending);
    table->ending = table->active = NULL;
    table->n = table->all_ending = table->capacity = table->own = table->n_own = table->n_ending = table->n_active = 0;
}

void species_gather(size_t row_bytes, const void *from, void *to, const int32_t *order, int64_t n)
{
    const char *source = from;
    char *target = to;
#define COPY(bytes) \
    case bytes: \
        for (int64_t i = 0; i < n; i++) memcpy(target + i * bytes, source + (int64_t)order[i] * bytes, bytes); \
        break;
    switch (row_bytes) {      /* a constant size lets the copy become a few moves */
    COPY(1) COPY(4) COPY(8) COPY(12) COPY(24)
    default: fail(STATUS_FAULT, "no copy for rows of %zu bytes", row_bytes);
    }
#undef COPY
}

static bool is_kept(const struct species *table, int c)
{ return species_has(table, c) && column_table[c].lifetime == KEEP; }

size_t species_widest(const struct species *table)
{
    size_t widest = 0;
    for (int c = 0; c < N_COLUMNS; c++)
        if (is_kept(table, c) && species_row_bytes(c) > widest) widest = species_row_bytes(c);
    return widest;
}

/* Fresh pages cost twice as much as the copies: one spare column serves all. The widest columns change places
 * with it, the others are copied back. What lies behind the last row stays zero. */
static void permute_columns(struct species *table, const int32_t *order, int64_t before)
{
    const size_t widest = species_widest(table);
    void *spare = mem_alloc("columns", (size_t)table->capacity * widest);
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!is_kept(table, c) || !rows_are_here(table, c)) continue;
        void **column = species_slot(table, c), *old = *column;
        const size_t row = species_row_bytes(c), bytes = (size_t)table->n * row;
        species_gather(row, old, spare, order, table->n);
        if (row == widest) {
            *column = spare;
            spare = old;
        } else {
            memcpy(old, spare, bytes);
        }
        memset((char *)*column + bytes, 0, (size_t)(before - table->n) * row);
    }
    mem_free(spare);
}

static void permute_own(struct species *table, const int32_t *order)
{
    void *spare = mem_alloc("columns", (size_t)table->n_own * species_widest(table));
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!is_kept(table, c)) continue;
        const size_t row = species_row_bytes(c);
        char *own = (char *)*species_slot(table, c) + (size_t)table->own * row;
        species_gather(row, own, spare, order, table->n_own);
        memcpy(own, spare, (size_t)table->n_own * row);
    }
    mem_free(spare);
}

void species_spread(struct species *table, int64_t own, int64_t n_own)
{
    table->own = own;
    table->n_own = n_own;
    for (int c = 0; c < N_COLUMNS; c++) {
        if (!species_has(table, c)) continue;
        const size_t row = species_row_bytes(c), from = (size_t)own * row, bytes = (size_t)n_own * row;
        char *whole = *species_slot(table, c), *part = reserve_part(table, row);
        if (bytes > 0) memcpy(part + from, whole + from, bytes);
        mem_free(whole);
        *species_slot(table, c) = part;
    }
    table->spread = true;
    table->capacity = table->n;
    table->ending = table->active = mem_resize("columns", table->ending, (size_t)(n_own + 1) * sizeof *table->ending);
}

void species_use(struct species *table, uint64_t columns, int64_t from, int64_t to)
{
    for (int c = 0; c < N_COLUMNS && table->spread; c++) {
        const size_t row = species_row_bytes(c);
        if (columns >> c & 1 && species_has(table, c)) mem_use(*species_slot(table, c), (size_t)from * row, (size_t)to * row);
    }
}

void species_forget(struct species *table)
{
    for (int c = 0; c < N_COLUMNS && table->spread; c++) {
        const size_t row = species_row_bytes(c);
        mem_drop(*species_slot(table, c), 0, (size_t)table->own * row);
        mem_drop(*species_slot(table, c), (size_t)(table->own + table->n_own) * row, (size_t)table->n * row);
    }
}

int64_t species_live(const struct species *table)
{
    int64_t live = table->n;
    for (int64_t i = 0; i < table->n && table->shrinks; i++) live -= species_gone(table, i);
    return live;
}

void species_drop(struct species *table)
{
    int64_t live = species_live(table), n = 0;
    if (live == table->n) return;
    int32_t *order = mem_array("columns", int32_t, live);
    for (int64_t i = 0; i < table->n; i++)
        if (!species_gone(table, i)) order[n++] = (int32_t)i;
    species_permute(table, order, live);
    mem_free(order);
}

void species_permute(struct species *table, const int32_t *order, int64_t n)
{
    check(n <= table->n && (!table->spread || n == table->n_own));
    const int64_t before = table->n;
    if (!table->spread) table->n = n;
    bool sorted = true;
    for (int64_t i = 0; i < n && sorted; i++) sorted = order[i] == i;
    if (sorted) return;
    rows_permute(table, order, n);
    if (table->spread) permute_own(table, order);
    else permute_columns(table, order, before);
}
