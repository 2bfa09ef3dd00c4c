/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to Hermite's schemes: the state of their module (hermite.c) and the sums over pairs (hermite_sums.c). */
#ifndef TEPHRA_GRAVITY_HERMITE_H
#define TEPHRA_GRAVITY_HERMITE_H
#include "gravity.h"
#include "hermite_engine.h"
#include "hermite_scheme.h"

enum { HERMITE_AUTO, HERMITE_DOUBLE, HERMITE_FLOAT };   /* precision; auto: double on the CPU, float on a device */
enum { HERMITE_BLOCKS = 32 };

/* A row's state at the start of its step: position, velocity, p derivatives. */
struct hermite_old { double pos[3], vel[3], f[HERMITE_P_MAX][3]; };

/* Of several ranks: sums, those for which the sources were shared out, and by count the work of a rank (in pairs): an equal
 * share of all, that of the busiest rank, and what that would have been with targets shared out always. */
struct hermite_shared { int64_t sums, of_sources; double all, busiest, by_targets; };

struct hermite {
    double eta, dt_min;
    int64_t iterations;
    int precision;
    int p;                      /* derivatives summed: half the order */
    struct gravity *gravity;
    struct hermite_rows rows;   /* all rows; those that this rank needs are predicted to now */
    double *room;               /* of rows */
    struct hermite_floats floats;   /* the same rows in floats, where sums are in floats */
    float *float_room;              /* of floats */
    struct hermite_units units;     /* of floats; saved */
    int64_t capacity;           /* of rows */
    int64_t base[N_SPECIES];    /* where a species begins among rows */
    /* One entry an own active row, species by species. */
    int32_t *target;            /* its place among rows */
    double (*sum)[HERMITE_P_MAX][3];
    struct hermite_old *old;
    double *step;               /* that the criterion allows */
    int64_t n, room_active;
    double noise;               /* relative error of the last sums, by the roundings of their pairs */
    double *part;               /* sums over segments of the sources */
    int64_t room_part;
    struct hermite_engine *engine;  /* on a device; made at the first sum */
    int64_t built, sent;        /* ticks of the tree, by which rows lie there, and of the states that are there */
    int64_t guarded;            /* steps that dt_min has kept from being shorter; saved */
    struct hermite_shared shared;
    int64_t block[HERMITE_BLOCKS];  /* steps in which 2^k to 2^(k+1) - 1 rows ended theirs */
};

/* The column of a derivative that a row keeps. */
extern const enum column hermite_column[HERMITE_DERIVATIVES - 2];

/* Room for all rows, and the list of the own active ones. */
void hermite_make_room(const struct sim *sim, struct hermite *h);
/* Fills h->sum of the own active rows with so many derivatives of the acceleration (p, or 4), all rows at now; corrected:
 * the states of the active rows are of now already. On all ranks. */
void hermite_evaluate(struct sim *sim, struct hermite *h, int derivatives, bool corrected);
/* Whether the device of the simulation is for these sums; and the sums there (hermite_device.c). False if the rows do not fit
 * and the CPU may do it instead (--device auto). */
bool hermite_on_device(const struct sim *sim, const struct hermite *h);
bool hermite_evaluate_device(struct sim *sim, struct hermite *h, int derivatives, bool corrected);
/* About the acceleration by all of the mass at the mean distance of the rows. */
double hermite_mean_pull(const struct hermite *h);
void hermite_free(struct hermite *h);
#endif
