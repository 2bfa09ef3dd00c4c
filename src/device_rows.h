/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows on a device. A column is up to date on the host, on the device, or on both; at first on the host alone.
 *
 * One rule: who is about to touch columns says so first. rows_here: the host reads these and writes those; rows_there: kernels
 * do. What is not up to date where it is asked for is copied, whole; what is written is out of date on the other side from then
 * on. So a column crosses only where the other side has written it since. Hooks of modules that are not marked `resident`
 * (module.h), and whatever is written to files, count as touching all columns on the host: they need to say nothing. A reorder
 * of the rows (species_permute) is done on each side with what is up to date there; rows that come or go otherwise are the
 * host's, and so are tables that are spread. */
#ifndef TEPHRA_DEVICE_ROWS_H
#define TEPHRA_DEVICE_ROWS_H
#include "species.h"

struct device;
struct sim;

#define COL(name) ((uint64_t)1 << COLUMN_##name)
/* Every column. */
#define COL_ALL UINT64_MAX
/* What tells where a row is now: sim_predict. */
#define COL_MOTION (COL(pos) | COL(vel) | COL(acc) | COL(rung) | COL(rung0))

/* The host is about to read and to write columns (bits) of the species in `mask`. Without a device nothing happens. */
void rows_here(struct sim *sim, unsigned mask, uint64_t read, uint64_t write);
/* Kernels are about to. The table as they see it: addresses on the device, of its columns among these (NULL the others), of the
 * lists `ending` and `active` (NULL where all rows end their step: entry e is row e, active a row own + a), and the numbers of
 * rows. If the device fails (device_error) all columns stay where they are. */
struct species rows_there(struct sim *sim, enum species_kind kind, uint64_t read, uint64_t write);
/* Whether kernels would find all of these columns there: a hook that could work on either side works where its rows are. */
bool rows_are_there(const struct species *table, uint64_t columns);
/* Room there for a column of the widest kind (24 bytes a row); what is put into it lasts until the rows are reordered or somebody
 * else asks. NULL if it does not fit. */
void *rows_scratch(struct sim *sim, enum species_kind kind);
/* Columns that have crossed since the start, either way, and their bytes. */
struct rows_crossed { int64_t columns, bytes; };
struct rows_crossed rows_crossed(const struct sim *sim);

/* For species.c: the lists have been made anew; rows are about to be reordered, to[i] = from[order[i]]; the table is about to
 * change its size: what is there comes home, and the device's memory is given back; it is freed. */
void rows_listed(struct species *table);
void rows_permute(struct species *table, const int32_t *order, int64_t n);
void rows_leave(struct species *table);
void rows_discard(struct species *table);
/* Whether the host's copy is up to date. */
bool rows_are_here(const struct species *table, enum column column);
#endif
