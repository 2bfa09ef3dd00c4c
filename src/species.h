/* SPDX-License-Identifier: GPL-3.0-or-later
 * The four species, each a table of its own. Rows lie in memory in the order of their keys.
 *
 * Row numbers are those of all ranks' rows together. A rank holds its own rows, [own, own + n_own); without
 * MPI own = 0 and n_own = n. Of other ranks' rows it holds copies: all of them or, where the table is
 * `spread`, those that it asked for (ghosts.h); the columns' other addresses are reserved and not touched.
 * Rows hold their state at their own time (timeline.h). */
#ifndef TEPHRA_SPECIES_H
#define TEPHRA_SPECIES_H
#include "columns.h"
#include <stdbool.h>
#include <stddef.h>

enum species_kind { GAS, CLOUD, STAR, DARK, N_SPECIES };
enum { GAS_BIT = 1 << GAS, CLOUD_BIT = 1 << CLOUD, STAR_BIT = 1 << STAR, DARK_BIT = 1 << DARK,
       ALL_SPECIES = (1 << N_SPECIES) - 1 };
extern const char *const species_names[N_SPECIES];

/* C++ would have no parentheses where a column has one component. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wparentheses"

struct copies;      /* of columns, on a device (device_rows.h) */

struct species {
    enum species_kind kind;
    int64_t n, capacity;            /* rows of all ranks, rows for which there are addresses */
    int64_t own, n_own;             /* this rank's rows */
    bool spread;                    /* other ranks' rows are here only where they were asked for */
    bool grows, shrinks;            /* a module may give it rows during the run, or take them (ranks_remove) */
    uint64_t columns;               /* bit (1 << COLUMN_x): asked for */
    int32_t *active;                /* own rows whose step ends now, ascending */
    int64_t n_active;
    int32_t *ending;                /* all rows here whose step ends now, other ranks' too unless spread; holds `active` */
    int64_t n_ending;
    int64_t all_ending;             /* rows of all ranks whose step ends now */
    struct copies *copies;          /* NULL: the columns are here alone */
#define COLUMN(name, type, dims, ...) type (*name) dims;
    SPECIES_COLUMNS(COLUMN)
#undef COLUMN
};
#pragma GCC diagnostic pop

/* Marks a column as needed. Columns are allocated by species_reserve. */
void species_need(struct species *table, enum column column);
static inline bool species_has(const struct species *table, enum column column)
{ return table->columns >> column & 1; }
/* Makes room for `capacity` rows in every needed column; keeps the rows there are. */
void species_reserve(struct species *table, int64_t capacity);
void species_free(struct species *table);
/* The rows that are here whatever happens: own ones of a spread table, else all. */
static inline int64_t species_from(const struct species *table) { return table->spread ? table->own : 0; }
static inline int64_t species_to(const struct species *table) { return table->spread ? table->own + table->n_own : table->n; }
/* The same of an empty table that is to be spread over the ranks: room for rows [own, own + n_own) of n. */
void species_reserve_part(struct species *table, int64_t n, int64_t own, int64_t n_own);
/* Of a spread table of which all rows are here: it is no longer spread. */
void species_join(struct species *table);
/* Of a table that every rank holds whole, keeps rows [own, own + n_own): it is spread from now on. */
void species_spread(struct species *table, int64_t own, int64_t n_own);
/* States that rows [from, to) of a spread table will be used in these columns (bits 1 << COLUMN_x). */
void species_use(struct species *table, uint64_t columns, int64_t from, int64_t to);
/* Gives back what a spread table holds beside its own rows. */
void species_forget(struct species *table);
/* Where the pointer of a column stands in the struct. */
void **species_slot(const struct species *table, enum column column);
/* The column's storage, NULL if not needed, and the bytes of one row of it. */
void *species_column(const struct species *table, enum column column);
size_t species_row_bytes(enum column column);
/* Bytes of a row of the widest column that is kept: what a row takes more while rows are sorted. */
size_t species_widest(const struct species *table);
/* to[i] = from[order[i]] for n rows of so many bytes. */
void species_gather(size_t row_bytes, const void *from, void *to, const int32_t *order, int64_t n);
/* Reorders every KEEP column: new row i is old row order[i]; n rows remain. Of a spread table the same with its own
 * rows, counted from the first of them; all remain. */
void species_permute(struct species *table, const int32_t *order, int64_t n);
/* Id of the number-th row (1 to 255) that was born from another: the number in the bits from 48 on, or, where these are in
 * use, from 56 on; 0 if those are in use too. */
static inline uint64_t species_child(uint64_t parent, unsigned number)
{ return parent >> 56 ? 0 : parent | (uint64_t)number << (parent >> 48 ? 56 : 48); }
/* The same for families without end: where all those bits are in use, a hash of both with the uppermost bit set (among 1e6 such
 * rows two have one id with a chance of 5e-8). */
static inline uint64_t species_heir(uint64_t parent, unsigned number)
{
    uint64_t id = species_child(parent, number), x = parent ^ number * UINT64_C(0x9E3779B97F4A7C15);
    if (id != 0) return id;
    x = (x ^ x >> 30) * UINT64_C(0xBF58476D1CE4E5B9);       /* SplitMix64: Steele, Lea & Flood 2014 */
    x = (x ^ x >> 27) * UINT64_C(0x94D049BB133111EB);
    return (x ^ x >> 31) | UINT64_C(1) << 63;
}
/* A row that was taken (ranks_remove): it has no mass and lies there until the tree is rebuilt. */
static inline bool species_gone(const struct species *table, int64_t i) { return table->shrinks && table->id[i] == UINT64_MAX; }
/* Rows that are not gone. */
int64_t species_live(const struct species *table);
/* Drops the rows that are gone; the others keep their order. */
void species_drop(struct species *table);
#endif
