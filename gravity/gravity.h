/* SPDX-License-Identifier: GPL-3.0-or-later
 * Private to gravity: the module's state and its parts (moments.c, walk.c, direct.c, check.c). */
#ifndef TEPHRA_GRAVITY_H
#define TEPHRA_GRAVITY_H
#include "black_holes.h"
#include "ghosts.h"
#include "kernels.h"
#include "pair.h"
#include "sim.h"

enum gravity_solver { SOLVER_AUTO, SOLVER_DIRECT, SOLVER_TREE, SOLVER_FMM };
enum { PRECISION_AUTO, PRECISION_ROUGH, PRECISION_FLOAT, PRECISION_DOUBLE };
enum { KERNEL_PLUMMER, KERNEL_SPLINE };

/* How far a walk goes; the numbers of Dehnen (2014), section 3, and measured ones (settings.c). */
struct gravity_opening {
    enum gravity_solver solver;
    int order;                  /* fmm: 3 to 6; tree: 1 monopole, 2 quadrupole */
    int leaf_size, group_size;  /* rows of a cell that is not opened; rows that share lists */
    double theta;               /* tree: side over distance from the group's box */
    double alpha;               /* fmm: error of one interaction over the least acceleration */
};

struct gravity {
    /* Parameters, as in the scene. */
    double softening, softening_of[N_SPECIES], accuracy, opening_angle, tolerance, time_step;
    int64_t order, group_size, leaf_size;
    int softening_kernel, solver, precision;
    bool mutual;                /* fmm: what a target accepts of a source is what the source accepts of the target */
    bool adaptive;              /* softening of gas: the spline's support is the one of its SPH kernel, 2 h */

    const struct gravity_kernels *kernels;
    struct gravity_opening opening;
    double G;
    enum softening_form form;       /* of references, in double */
    enum softening_form pair_form;  /* of kernels: a length that floats cannot tell from zero is not common */
    double half_soft2[N_SPECIES];   /* what a row brings to the softening of a pair, squared: gravity_half_soft2 */
    double half_soft2_hole;         /* and a black hole */
    double far_soft2;               /* Plummer softening squared between cells */
    double support;                 /* of the spline: cells act beyond it (of adaptive gas: h_max of its cells) */
    double near2;                   /* unequal softenings: cells act beyond this distance squared */

    double unit;                    /* of length, in pairs of rows: a power of two, of the present tree */
    enum gravity_refinement refinement; /* of pairs, by the settings */

    struct gravity_leaf *leaf;      /* rows.c: one a node */
    struct gravity_source *row;
    float *soft;                    /* one a row; not where softening is common */
    int32_t epoch;                  /* a leaf staged in this epoch is up to date */
    int64_t first_row, n_rows;      /* places of the own rows among the staged ones */
    int64_t rows_room;              /* staged rows that there are addresses for */
    struct gravity_cell *cell;      /* the tree's columns: one a node; the least acceleration of its rows, bounded below */
    float *least;
    int32_t n_cells, n_placed;      /* cells; cells whose rows have their places, those that were opened too */
    int64_t built, fitted;          /* ticks of the tree that the cells are of */

    double scale;                   /* of the opening, set by the self-check; saved */
    int64_t rows;                   /* at the start of the run, by which `auto` chooses; saved */
    int64_t known;                  /* the column grav is filled; saved */
    int64_t checked;                /* self-checks done; saved */
    int64_t refined;                /* a self-check has found that rough pairs do not do; saved */
    double measured;                /* 99th percentile of the error at the last self-check */
    struct walk *walk;              /* one a thread: their memory is kept from force to force */
    int n_walks;
    struct direct_engine *engine;   /* on a device; made at the first force */
    struct walk_engine *walk_engine;
    int64_t pairs, cells;           /* interactions of the last force: rows, cells */
    double bound;                   /* twice the potential energy of own rows, where it was summed in double */
    bool left;                      /* the integrator sums the forces and sets the steps */
};

/* For integrators that sum forces themselves: this module computes potentials only, in double. Called in declare. */
void gravity_leave_forces(struct sim *sim, struct gravity *g);

/* What row i brings to the softening of a pair, squared: half of its own. */
static inline double gravity_half_soft2(const struct gravity *g, const struct species *s, int64_t i)
{
    if (g->adaptive && s->kind == GAS) return 2 * (double)s->h[i] * (double)s->h[i];
    return black_hole_is(s, i) ? g->half_soft2_hole : g->half_soft2[s->kind];
}
/* What of a row of another rank a force needs. */
static inline enum ghost_rows gravity_ghost_rows(const struct gravity *g) { return g->adaptive ? GHOST_ALL : GHOST_MOTION; }

static inline enum gravity_refinement gravity_refinement(const struct gravity *g)
{ return g->refined ? GRAVITY_REFINED : g->refinement; }

/* Rows of a cell that acts as a whole or row by row, but is not opened. */
static inline bool gravity_is_leaf(const struct gravity *g, const struct node *node)
{ return node->n_children == 0 || (!node->stretched && node_rows(node, ALL_SPECIES) <= g->opening.leaf_size); }

/* Rows that share their interaction lists: the topmost cells for which this holds. */
static inline bool gravity_is_group(const struct gravity *g, const struct node *node)
{ return node->n_children == 0 || (!node->stretched && node_rows(node, ALL_SPECIES) <= g->opening.group_size); }

/* The rows of a cell that is another rank's are here: room to stage them. */
void gravity_rows_use(struct gravity *g, int32_t n);
/* Room for the staged rows of a new tree. After the rows or the cells have moved: epoch++. */
void gravity_rows_build(struct sim *sim, struct gravity *g);
void gravity_rows_free(struct gravity *g);
/* Which rows cell n holds. */
void gravity_rows_place(struct gravity *g, int32_t n, const struct node *node);
/* The rows of leaf n about its cell's centre, staged now if need be; any thread. */
const struct gravity_leaf *gravity_rows_leaf(const struct sim *sim, const struct gravity *g, int32_t n);

/* Multipoles, reach and least accelerations of all cells of a new tree; and after a refit. */
void gravity_moments_build(struct sim *sim, struct gravity *g);
void gravity_moments_refit(struct sim *sim, struct gravity *g);
/* After other ranks' cells were opened (ghosts.h). */
void gravity_moments_open(struct sim *sim, struct gravity *g);
/* The bounds on accelerations alone, from the column grav. */
void gravity_moments_least(struct sim *sim, struct gravity *g);
/* Floats a node of the column `moment`: 0 for monopoles. */
int gravity_moments_width(const struct gravity_opening *opening);

/* Accelerations added to acc of the active rows (and pot filled, if the step is recorded); or only
 * their size into grav; or only pot. */
enum gravity_output { OUTPUT_FORCE, OUTPUT_SIZE, OUTPUT_POTENTIAL };
void gravity_walk(struct sim *sim, struct gravity *g, enum gravity_output output);
void gravity_walk_free(struct gravity *g);
void gravity_direct(struct sim *sim, struct gravity *g, enum gravity_output output);
/* The same on the device of the simulation, in pairs of floats; false if the rows do not fit and the
 * CPU may do it instead (--device auto). */
bool gravity_direct_device(struct sim *sim, struct gravity *g, enum gravity_output output);
/* The same of solvers tree and fmm, without softening_adaptive and mutual. */
bool gravity_walk_device(struct sim *sim, struct gravity *g, enum gravity_output output);

/* Acceleration and potential of listed rows of one species by direct sums in double: acc[4 i] is
 * ax, ay, az, potential of row list[i]. Of spread rows on all ranks together. */
void gravity_direct_rows(const struct sim *sim, const struct gravity *g, const struct species *s,
                         const int32_t *list, int64_t n, double (*acc)[4]);

/* A row of the shipped chart doc/charts/gravity.csv: opening is the tolerance of fmm or the angle of tree; p99: the worst
 * of its sets, as `accuracy` counts errors; cpu: microseconds a row of Plummer's sphere. row NULL ends. */
struct gravity_front { double accuracy; const char *row; int order; double opening, p99, cpu; };
/* The measured front of a solver, and its entry for an accuracy. */
const struct gravity_front *gravity_settings_front(enum gravity_solver solver);
const struct gravity_front *gravity_settings_row(enum gravity_solver solver, double accuracy);
/* The solver's order, sizes and opening for a 99th percentile of the error. */
void gravity_settings(struct gravity_opening *opening, double accuracy);

/* `accuracy` counts errors of accelerations against the larger of their size and this part of the rms size. */
#define GRAVITY_FLOOR 1e-2

/* Errors of accelerations. */
struct gravity_errors { int64_t n; double rms, median, p99, max; };
struct gravity_errors gravity_errors_of(double *error, int64_t n);
/* The same of the errors of all ranks together. */
struct gravity_errors gravity_errors_shared(double *own, int64_t n);

/* One force of all rows with a tree of its own: CPU seconds of all ranks. */
struct gravity_cost { double build, walk; };
struct gravity_cost gravity_force(struct sim *sim);
int64_t gravity_count_rows(const struct sim *sim);
/* About `sample` rows drawn by their ids, with their direct sums in double: exact[4 i] is ax, ay, az,
 * potential of row[i]. Valid until the rows are permuted. */
struct gravity_reference { int32_t *row[N_SPECIES]; int64_t n[N_SPECIES]; double (*exact[N_SPECIES])[4]; };
struct gravity_reference gravity_reference_make(const struct sim *sim, const struct gravity *g, int64_t sample);
struct gravity_errors gravity_reference_compare(const struct sim *sim, const struct gravity_reference *r);
/* The 99th percentile of the errors as `accuracy` counts them. */
double gravity_reference_held(const struct sim *sim, const struct gravity_reference *r);
/* Of one acceleration; that of a row without any counts absolutely. */
double gravity_relative_error(const float acc[3], const double exact[4]);
void gravity_reference_free(struct gravity_reference *r);
/* Takes the settings anew from the parameters, which may have changed since `begin`. */
void gravity_configure(struct sim *sim, struct gravity *g);

/* The self-check: a sample of about 1024 rows, chosen by their ids, against direct sums. */
struct gravity_sample;
bool gravity_check_due(const struct sim *sim, const struct gravity *g);
struct gravity_sample *gravity_check_begin(struct sim *sim, const struct gravity *g);
/* Logs asked and measured and scales the opening. False if the force just added misses what was
 * asked: it is taken back then and has to be computed again. */
bool gravity_check_passes(struct sim *sim, struct gravity *g, struct gravity_sample *sample);
void gravity_check_end(struct gravity_sample *sample);
#endif
