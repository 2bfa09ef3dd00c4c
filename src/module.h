/* SPDX-License-Identifier: GPL-3.0-or-later
 * A module: one const struct and no other exported symbol. A block of that name in the scene, or
 * its name as time.integrator, makes it part of the run; modules.c holds the one list. A step is a
 * loop over the hooks of the modules in use, hook by hook, module by module in the list's order. */
#ifndef TEPHRA_MODULE_H
#define TEPHRA_MODULE_H
#include "param.h"
#include "sim.h"

enum hook {
    HOOK_PREDICT,   /* active rows to the present tick */
    HOOK_ARRANGE,   /* keys, sort, ranks, tree: rebuild or refit */
    HOOK_H,         /* smoothing lengths */
    HOOK_DENSITY,   /* density, div v, curl v */
    HOOK_FORCE,     /* every module ADDS to acc and du of the active rows */
    HOOK_CORRECT,   /* active rows: the end of their step */
    HOOK_SOURCE,    /* stiff terms over the same step, by exact or implicit integration */
    HOOK_EVENT,     /* rows change species or mass; indices hold to the end */
    HOOK_LIMIT,     /* every module lowers dt of the active rows where it must; sleepers are woken */
    HOOK_RECORD,    /* log line, energies, snapshot and picture if due */
    N_HOOKS
};
extern const char *const hook_names[N_HOOKS];

/* A conserved or booked quantity that a module adds to energy.csv. Names are the columns'. */
struct energy_sink { void (*add)(struct energy_sink *sink, const char *column, double value); };

/* A field of the private state that a checkpoint must hold. */
struct saved { const char *name; size_t offset, bytes; };

enum module_kind {
    MODULE_BLOCK,       /* used when the scene has a block of its name */
    MODULE_FRAME,       /* always used */
    MODULE_DRIVER,      /* used in every run, not where only forces are asked for */
    MODULE_INTEGRATOR   /* used when time.integrator names it */
};

/* What holds a row's step down, for the log. */
struct step_reason { double dt; const char *text; };

struct module {
    const char *name, *doc;             /* doc: one line */
    enum module_kind kind;
    const struct param *params;         /* its block; NULL = no block */
    const char *const *requires;        /* names of modules that must be there too; NULL-ended */
    bool open_space;                    /* refused together with a box (box.h) */
    bool resident;                      /* its hooks say which columns they touch (device_rows.h); else all come to the host */
    bool whole;                         /* reads rows of other ranks without asking for them: every rank must hold all rows */
    const char *companion;              /* its files COMPANION_NNN.* have the number of the snapshot they lie beside (output.h) */
    size_t state_bytes;                 /* private state; params fill its fields by offset */
    const struct saved *saved;          /* what a checkpoint holds of it; name NULL ends */
    /* Checks parameters against each other (sim->problems) and asks for columns of species and nodes. */
    void (*declare)(struct sim *sim, void *state);
    void (*begin)(struct sim *sim, void *state);    /* rows are there; before the first step */
    void (*end)(struct sim *sim, void *state);
    void (*hook[N_HOOKS])(struct sim *sim, void *state);
    void (*potential)(struct sim *sim, void *state);/* fills pot of all own rows, at full synchronisation */
    void (*energy)(struct sim *sim, void *state, struct energy_sink *sink); /* own rows; summed over ranks */
    /* Columns of budget.csv, their names with units ("sfr [Msun yr^-1]"); own rows, summed over ranks. */
    void (*budget)(struct sim *sim, void *state, struct energy_sink *sink);
    /* The gas of scenes with units: temperatures of all rows from species_from on, where the last module of the list that has a
     * say is right; and K per code unit of u for gas of one mean mass, which files and generators convert by. */
    void (*temperature)(const struct sim *sim, const void *state, float *kelvin);
    double (*kelvin)(const struct sim *sim, const void *state);
    /* If the module's LIMIT allows an active row less than reason->dt: its step, and which criterion it is. */
    void (*reason)(const struct sim *sim, const void *state, const struct species *table, int64_t row,
                   struct step_reason *reason);
    void (*warn)(struct sim *sim, void *state);     /* settings beyond a known boundary: log_warning */
};

/* Makes initial conditions. Params describe its keys in `start` and in `tephra ics`. */
struct generator {
    const char *name, *doc;
    const struct param *params;
    size_t state_bytes;
    /* Before other blocks are read: start_advise for their keys whose best value follows from the model and n.
     * Mistakes are told by make. NULL: none. */
    void (*advise)(struct sim *sim, const void *state, int64_t n);
    bool own_n;     /* how many rows there are follows from its keys: start.n has no meaning, and n below is negative */
    /* Fills the species tables with exactly n rows in all; ids from 1. */
    void (*make)(struct sim *sim, const void *state, int64_t n);
};

struct command {
    const char *name, *usage, *doc;
    int (*run)(int argc, char **argv);  /* argv[0] is the command's name; returns the exit status */
};

/* The one list (modules.c), each NULL-ended. */
extern const struct module *const module_list[];
extern const struct generator *const generator_list[];
extern const struct command *const command_list[];
#endif
