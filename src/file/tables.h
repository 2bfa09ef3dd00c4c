/* SPDX-License-Identifier: GPL-3.0-or-later
 * The tables of rows that a file holds, whatever wrote it: PartType groups of snapshots, Rows/<species>
 * of checkpoints, and data sets beside ParticleIDs at the root. For `tephra info` and `tephra compare`. */
#ifndef TEPHRA_TABLES_H
#define TEPHRA_TABLES_H
#include <stdbool.h>
#include <stdint.h>

struct h5;

enum { TABLES_MOST = 12, TABLES_SETS = 64, TABLES_NAME = 96 };

struct table {
    char group[TABLES_NAME];                /* "PartType0"; "" = the root */
    char species[TABLES_NAME];              /* "gas"; the group's name where nothing says */
    const char *pos, *vel, *mass, *id, *u, *pot;    /* names of these data sets in this kind of file */
    int64_t rows;
    char set[TABLES_SETS][TABLES_NAME];     /* data sets with that many rows */
    int n_sets;
};

/* Finds at most TABLES_MOST tables; returns how many. */
int tables_find(struct h5 *file, struct table tables[TABLES_MOST]);
bool tables_has(const struct table *table, const char *set);
void tables_path(const struct table *table, const char *set, char path[2 * TABLES_NAME]);
/* A whole data set as doubles, for mem_free; NULL if the table has none of that name. */
double *tables_read(struct h5 *file, const struct table *table, const char *set, int *components);
/* Ids, for mem_free; the row numbers where there are none. */
uint64_t *tables_read_ids(struct h5 *file, const struct table *table);
#endif
