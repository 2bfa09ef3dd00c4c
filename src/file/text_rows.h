/* SPDX-License-Identifier: GPL-3.0-or-later
 * Rows as text: columns named in the first line (CSV, or words after a #), or seven or eight columns without names (mass,
 * position, velocity; an id before them), or phi-GRAPE's data.inp (number of the snapshot, number of rows, time, then rows of
 * id, mass, position, velocity). */
#ifndef TEPHRA_TEXT_ROWS_H
#define TEPHRA_TEXT_ROWS_H
#include "formats.h"

extern const struct format text_rows_format;
#endif
