/* SPDX-License-Identifier: GPL-3.0-or-later
 * The rows of a species as a file has them, cut into slices, one a rank: of spread rows no rank holds more than its slice of
 * a column. The first rank writes them, slice after slice as they come to it. Where every rank holds all rows, the first one's
 * slice is all of them. All ranks call all functions. */
#ifndef TEPHRA_SLICES_H
#define TEPHRA_SLICES_H
#include "species.h"

struct h5;
struct sim;

struct slices {
    int64_t rows;           /* in the file */
    int64_t n_here;         /* that this rank brings in, */
    int32_t *order;         /* ... and which: ascending by id; NULL: its own ones as they lie */
    int64_t *slice;         /* rows of each rank's slice */
    int64_t *out, *in;      /* that go to and come from the slice of each rank; NULL: none do */
    int32_t *sorted;        /* row i of the own slice is the sorted[i]-th of those that came */
};

/* Rows of a PartType (layout.h) by ascending id; those that are gone are left out. */
struct slices slices_by_id(const struct sim *sim, const struct species *table, int type);
/* Rows as they lie: in the order of their keys. */
struct slices slices_of_rows(const struct sim *sim, const struct species *table);
void slices_free(struct slices *slices);

/* A data set; kind as in h5.h. file: NULL on other ranks than the first. */
struct slices_set { struct h5 *file; const char *path; char kind; int components; };
/* Writes it from the rows that this rank brings in, in their order there (slices_by_id: an own block of memory, which is
 * freed; slices_of_rows: the column from the own rows on). */
void slices_write_by_id(const struct slices *slices, const struct slices_set *set, void *values);
void slices_write_rows(const struct slices *slices, const struct slices_set *set, const void *own);
#endif
