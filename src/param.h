/* SPDX-License-Identifier: GPL-3.0-or-later
 * Parameters: a const table beside each module describes its block of the scene file. From it come
 * parsing, errors, `tephra params`, the man page and the used values written with every run. */
#ifndef TEPHRA_PARAM_H
#define TEPHRA_PARAM_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum param_type {
    PARAM_REAL,     /* double, in code units */
    PARAM_COUNT,    /* int64_t */
    PARAM_FLAG,     /* bool: on/off, yes/no, true/false */
    PARAM_CHOICE,   /* int: index into choices */
    PARAM_LIST,     /* struct param_list: numbers with commas between */
    PARAM_TEXT,     /* char * */
    PARAM_PATH      /* char *, relative to the scene file (typed after --set: to the working
                       directory); absolute once read */
};

enum { PARAM_LIST_MAX = 24 };
struct param_list { int n; double value[PARAM_LIST_MAX]; };

struct param {
    const char *name;
    enum param_type type;
    const char *unit;       /* PARAM_REAL, _LIST: dimension by name (units.h) such as "length", "time",
                               "temperature", "velocity", "mass", "density"; "" = pure number */
    const char *fallback;   /* default as a scene would write it; NULL = must be given;
                               "none" = absent (REAL: NAN, COUNT: -1, TEXT: NULL). Where the block has
                               a choice `preset`: "50|100", one a preset in its order */
    double low, high;       /* range, inclusive; both 0 = any finite value. In code units */
    const char *choices;    /* PARAM_CHOICE: "leapfrog|pec" */
    const char *text;       /* one sentence */
    bool at_restart;        /* may change when a run is continued */
    size_t offset;          /* of the value in the owner's struct */
};
/* A table ends with a row whose name is NULL. */

struct scene;
struct units;
struct problems;

/* Reads block `block` of the scene by the tables (each paired with the struct it fills) and adds to
 * `problems` what is wrong: unknown keys with the nearest known one, wrong units, values out of
 * range, missing keys. A block may be described by several tables (start: the frame's own and its
 * generator's); `tables` ends with {NULL, NULL}. */
struct param_target { const struct param *table; void *values; };
void param_read(const struct scene *scene, const char *block, const struct param_target *tables,
                const struct units *units, struct problems *problems);
/* Whether the scene gives a pure number another value than its default: it has chosen it (used.yml says every key). */
bool param_chosen(const struct scene *scene, const char *block, const struct param *table, const char *key);
/* Writes "  key: value" lines for used.yml: in code units, so that reading them gives the same bits;
 * texts quoted, paths absolute. */
void param_write(FILE *stream, const struct param_target *tables);
/* One text as a double-quoted YAML scalar. */
void param_write_text(FILE *stream, const char *text);
/* Frees the texts and paths that param_read allocated. */
void param_free(const struct param_target *tables);
/* Human-readable table rows for `tephra params` and, as roff, for the man page. */
void param_describe(FILE *stream, const char *block, const struct param *table, bool roff);
#endif
