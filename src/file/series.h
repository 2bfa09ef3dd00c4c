/* SPDX-License-Identifier: GPL-3.0-or-later
 * Time series: CSV files of the run directory to which a run appends, such as energy.csv. Their first column is
 * "t [unit]", in the units of the snapshots. One rank writes. */
#ifndef TEPHRA_SERIES_H
#define TEPHRA_SERIES_H
#include "sim.h"
#include <stdio.h>

/* Opens a series of the run directory for more rows. If it is new, the caller gives the names of the other columns, each
 * with a comma before it: header(file, context). */
FILE *series_open(const struct sim *sim, const char *name, void (*header)(FILE *file, const void *context), const void *context);
/* Begins a row with the present time; the caller adds the other columns, each with a comma before it, and a newline. */
void series_time(const struct sim *sim, FILE *file);
void series_close(const struct sim *sim, const char *name, FILE *file);
/* Whether a file is one of these series. */
bool series_is(const char *path);
/* Before a run goes on: drops the rows of all series that are later than now, or cut short. */
void series_trim(const struct sim *sim);
#endif
