/* SPDX-License-Identifier: GPL-3.0-or-later
 * Strict about numbers: a NaN, a negative mass or an id used twice is a problem that names the particle. */
#ifndef TEPHRA_START_CHECK_H
#define TEPHRA_START_CHECK_H
#include "sim.h"

/* with_kelvin: gas rows whose u came from a temperature, of all ranks. */
struct start_rows { struct sim *sim; const char *path; int64_t with_kelvin; };

/* Rows that have just been read from `path`. All ranks, each its own rows where they are spread. */
void start_check_rows(const struct start_rows *rows);
#endif
