/* SPDX-License-Identifier: GPL-3.0-or-later
 * Initial conditions from a file: tephra's own, GADGET's, AREPO's or SWIFT's HDF5 files, and what formats.h knows. */
#ifndef TEPHRA_START_FILE_H
#define TEPHRA_START_FILE_H
#include "sim.h"

/* Fills the species tables, whose columns have been asked for, with the rows of the file, in the
 * file's order. PartType0 is gas, 1 dark, 2 to 5 stars, unless the group's attribute `species` says
 * otherwise (tephra writes clouds into PartType3). A column that the file lacks stays 0. Numbers are
 * converted from the file's units, which are kpc, 1e10 Msun, km/s if it names none; a dimensionless
 * scene takes them as they are. time.start becomes the file's time. What is wrong with the file goes
 * to sim->problems. */
void start_file_read(struct sim *sim, const char *path);
/* The same of one of several files, whose ids become larger by `shift`; rows that are there already stay. */
void start_file_add(struct sim *sim, const char *path, uint64_t shift);
/* Asks for the columns that the file has. */
void start_file_need_all(struct sim *sim, const char *path);
#endif
