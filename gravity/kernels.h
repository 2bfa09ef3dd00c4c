/* SPDX-License-Identifier: GPL-3.0-or-later
 * The engine of gravity: kernels on small float tiles relative to the centre of a target group, in
 * units of its size, without G. One table an instruction set, chosen at run time. */
#ifndef TEPHRA_GRAVITY_KERNELS_H
#define TEPHRA_GRAVITY_KERNELS_H
#include "isa.h"
#include <stdbool.h>
#include <stdint.h>

enum { GRAVITY_LANES_MAX = 16, GRAVITY_ORDER_MIN = 3, GRAVITY_ORDER_MAX = 6, GRAVITY_ORDERS = 4,
       GRAVITY_FORMS = 3 };

/* The rows whose force is wanted. Columns are padded to a multiple of the lanes, 64-byte aligned. */
struct gravity_targets {
    int n, capacity;
    float *x, *y, *z;           /* in the unit of pairs */
    float unit;                 /* that unit in the unit of the cells that act on these rows */
    float *soft;                /* half the row's softening squared (of its support squared) */
    int32_t *own;               /* which of the group's own sources is this row */
    double *ax, *ay, *az, *depth;   /* sums; depth is minus the potential */
};

struct gravity_source { float x, y, z, mass; };
/* Rows that act on a group, about its centre in the unit of pairs. */
struct gravity_sources {
    int n, capacity;
    struct gravity_source *row;
    float *soft;                /* half the softening squared, where it is not common */
    float soft2;                /* the common one, squared */
};

/* A cell as a walk sees it, a cache line. Moments are in units of mass and powers of `scale`. */
struct gravity_cell {
    double pos[3];              /* centre of mass now */
    float reach;                /* all rows lie within this of pos */
    float scale;                /* a power of two near reach; 0: below a leaf */
    float mass;                 /* times G */
    float power[5];             /* binomial(order, k) |M_k|, k = 2 to 6 */
    int32_t child;
    int16_t n_children;         /* 0: a leaf */
    int16_t group;              /* small enough to be a target group, or within one */
};

/* The rows of a cell in the order of the keys of all species; and of a leaf, when they were staged. */
struct gravity_leaf { int32_t first, n, staged; };

/* What a walk decides about a source cell for a target cell. */
enum gravity_verdict {
    GRAVITY_LOCAL,              /* into the target's local expansion */
    GRAVITY_FAR,                /* acts on the rows of the group */
    GRAVITY_NEAR,               /* its rows act on the rows of the group */
    GRAVITY_WAIT,               /* handed down to the target's children; of a group: itself */
    GRAVITY_OPEN,               /* its children are judged instead */
    GRAVITY_OPEN_FAR,           /* its children too, but none goes into the local expansion */
    GRAVITY_VERDICTS
};
/* A target cell and its bounds for accepting a source. Floats are in units of `unit`. */
struct gravity_view {
    /* Unless NULL: source and target accept each other or not at all; lengths are from the centre of mass. */
    const struct gravity_cell *self;
    const float *least;         /* of every cell: its least acceleration; NULL: not known */
    int32_t parent;
    float alpha;                /* tolerance of a source as a target: this times its least acceleration */
    double centre[3], unit;
    int32_t cell;
    int32_t group;              /* 0 or 1 */
    int32_t no_local;           /* 0 or 1: the target is too large for a local expansion of these sources */
    float half[3], radius;      /* of its box */
    float tolerance;            /* largest error of one cell */
    float quadrupole;           /* |M_2| is this times power[0] */
    float support, near2;       /* cells act beyond: softening */
    const float *h_max;         /* adaptive softening: beyond twice this of a source too, in the unit of the cells; else NULL */
    float theta2, theta2_target, theta2_cell;   /* opening angles squared */
    float open_ratio;           /* a source this much larger than the target is opened */
};
typedef void gravity_judge(int32_t *verdict, const struct gravity_view *v, const struct gravity_cell *cell,
                           const int32_t *list, int64_t n);
/* [adaptive softening] */
struct gravity_judge_table { gravity_judge *fmm[2][GRAVITY_ORDERS], *mutual[2][GRAVITY_ORDERS], *tree[2]; };
extern const struct gravity_judge_table gravity_judge_table_v2, gravity_judge_table_v3, gravity_judge_table_v4;

/* Cells that act on one target: `list` of n. Lengths are taken in units of `scale` from `centre`. */
struct gravity_far {
    const struct gravity_cell *cell;
    const float *moment;        /* `width` a cell: M_abc times G, from order 2 */
    int width;
    const int32_t *list;
    int n;
    double centre[3], scale;
    float soft2;                /* softening squared, in those units */
};

/* Positions (pos - centre) inverse and G m of n rows, to floats. */
struct gravity_frame { double centre[3], inverse, G; };
typedef void gravity_stage_rows(struct gravity_source *out, const struct gravity_frame *frame,
                                const double (*pos)[3], const double *mass, int64_t n);
/* n rows about another centre, which lies at `shift`. */
typedef void gravity_shift_rows(struct gravity_source *out, const struct gravity_source *row, const float shift[3], int n);
typedef void gravity_pair_sum(struct gravity_targets *t, const struct gravity_sources *s);
/* REFINED: one Newton step on 1/sqrt; ROUGH: the processor's guess, with errors of 3 guess_error at most. */
enum gravity_refinement { GRAVITY_REFINED, GRAVITY_ROUGH, GRAVITY_REFINEMENTS };
/* Indexed by enum gravity_refinement and enum softening_form. */
struct gravity_pair_table {
    gravity_pair_sum *acc[GRAVITY_REFINEMENTS][GRAVITY_FORMS];   /* acceleration */
    gravity_pair_sum *pot[GRAVITY_REFINEMENTS][GRAVITY_FORMS];   /* and potential */
    gravity_pair_sum *own[GRAVITY_REFINEMENTS][GRAVITY_FORMS];   /* the sources are the group's own: no row sees itself */
    gravity_stage_rows *stage;              /* rows that need no prediction */
    gravity_shift_rows *shift;
    float guess_error;                      /* of the processor's 1/sqrt, relative */
};
typedef void gravity_cell_sum(struct gravity_targets *t, const struct gravity_far *far);
typedef void gravity_local_sum(float *local, const struct gravity_far *far);
/* Depth and acceleration at the centre, added to field. */
typedef void gravity_row_sum(double *field, const struct gravity_far *far);
/* Moments of n rows whose unit of length is `unit` of the moments'. */
typedef void gravity_moment_sum(float *moment, const struct gravity_source *row, int n, float unit);
typedef void gravity_local_field(struct gravity_targets *t, const float *local);
/* Indexed by order - GRAVITY_ORDER_MIN. local: L_abc, CELL_TERMS_MAX of them. */
struct gravity_far_table {
    gravity_cell_sum *monopoles[2], *quadrupoles[2];    /* [with potential] */
    gravity_moment_sum *of_rows[GRAVITY_ORDERS];        /* M_abc of orders 2 to order - 1, set */
    gravity_local_sum *to_local[GRAVITY_ORDERS];        /* cells to a local expansion, added */
    gravity_row_sum *on_row[GRAVITY_ORDERS];            /* cells on one row */
    gravity_local_field *at_targets[GRAVITY_ORDERS];    /* of L_abc / (a! b! c!), added */
};
extern const struct gravity_pair_table gravity_pair_table_v2, gravity_pair_table_v3, gravity_pair_table_v4;

extern const struct gravity_far_table gravity_far_table_v2, gravity_far_table_v3, gravity_far_table_v4;

/* Rows in double, in code units from any origin. */
enum { GRAVITY_EXACT = 256 };
struct gravity_exact {
    int n;
    double x[GRAVITY_EXACT], y[GRAVITY_EXACT], z[GRAVITY_EXACT], mass[GRAVITY_EXACT], soft[GRAVITY_EXACT];
};
/* Adds to sum (ax, ay, az, depth) of the target (x, y, z, soft). */
typedef void gravity_exact_sum(double sum[4], const double target[4], const struct gravity_exact *s);
struct gravity_exact_table { gravity_exact_sum *sum[GRAVITY_FORMS]; };
extern const struct gravity_exact_table gravity_exact_table_v2, gravity_exact_table_v3, gravity_exact_table_v4;

/* Rows of all species in double, predicted to now, in code units: masses times G, soft as for pairs. From n on, up to a
 * multiple of the lanes, rows without mass. */
struct hermite_rows {
    int64_t n;
    double *pos[3], *vel[3], *acc[3], *jerk[3], *mass, *soft;
};
/* Derivative d of the acceleration along axis k into entry 3 d + k, by the sources `from` (a multiple of the lanes) to `to`;
 * target: pos, vel, acc, jerk, soft. A row that is its own source adds nothing. */
typedef void hermite_sum(double *sum, const double target[13], const struct hermite_rows *s, int64_t from, int64_t to);
/* [a softening may be zero][derivatives - 2] */
struct hermite_table { hermite_sum *sum[2][3]; int lanes; };
extern const struct hermite_table hermite_table_v2, hermite_table_v3, hermite_table_v4;

/* The same rows in floats, in units of powers of two (velocity^2 length for the masses): a position is high + low. */
struct hermite_floats {
    float *high[3], *low[3], *vel[3], *acc[3], *mass, *soft;
};
/* As hermite_sum with two or three derivatives, in these units, the target too. */
typedef void hermite_float_sum(double *sum, const double target[13], const struct hermite_floats *s, int64_t from, int64_t to);
struct hermite_float_table { hermite_float_sum *sum[2][2]; };    /* [a softening may be zero][derivatives - 2] */
extern const struct hermite_float_table hermite_float_table_v2, hermite_float_table_v3, hermite_float_table_v4;

struct gravity_kernels {
    int lanes;
    const struct gravity_pair_table *pair;
    const struct gravity_far_table *far;
    const struct gravity_exact_table *exact;
    const struct gravity_judge_table *judge;
    const struct hermite_table *hermite;
    const struct hermite_float_table *hermite_float;
};
const struct gravity_kernels *gravity_kernels_find(enum isa isa);

#endif
