/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `start`: where the rows of a run come from, a generator or a file. */
#ifndef TEPHRA_START_H
#define TEPHRA_START_H
#include "param.h"

struct sim;
struct generator;

struct start {
    char *generator, *file;
    int64_t n, seed;
    bool strip_h;                   /* files of cosmological runs become physical (start_cosmology.h) */
    const struct generator *maker;  /* of that name; NULL when rows come from a file */
    void *maker_state;              /* filled from the generator's own parameters */
};
extern const struct param start_params[];

/* Reads the block. Mistakes go to sim->problems. */
void start_read(struct sim *sim);
/* Makes or reads the rows, of spread ones (sim->spread) those of this rank alone; sets the time line's start from a file's
 * Time. */
void start_load(struct sim *sim);
/* For a generator's advise: a value, in code units, of a key of another block that the scene leaves open. */
void start_advise(struct sim *sim, const char *block, const char *key, double value);
void start_free(struct start *start);
/* The tables that describe the block, for param_write. */
void start_targets(const struct start *start, struct param_target targets[3]);
const struct generator *start_find_generator(const char *name);
#endif
