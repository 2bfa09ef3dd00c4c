/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `box`: sides along which space closes on itself. Row positions are kept within [0, side)
 * where the tree is rebuilt and may leave it a little until the next time; whoever looks for pairs asks for the
 * images in reach. Where no block is given, or for an axis without a side, space is open. */
#ifndef TEPHRA_BOX_H
#define TEPHRA_BOX_H
#include "param.h"
#include <math.h>

struct sim;

struct box { double side[3]; };     /* 0: open along this axis */
extern const struct param box_params[];

static inline bool box_closed(const struct box *box)
{ return box->side[0] > 0 || box->side[1] > 0 || box->side[2] > 0; }
static inline bool box_cubic(const struct box *box)
{ return box->side[0] > 0 && box->side[0] == box->side[1] && box->side[0] == box->side[2]; }
/* Of the images of a distance along an axis, the whole sides to add that make it the nearest one. */
static inline double box_shift(const struct box *box, int axis, double distance)
{ return box->side[axis] > 0 ? -box->side[axis] * rint(distance / box->side[axis]) : 0; }
/* Brings a position into the box. */
void box_wrap(const struct box *box, double pos[3]);
/* Brings every row's position now into the box. */
void box_wrap_rows(struct sim *sim);
/* Whole numbers of sides, first to last along each axis, by which the interval `own` must be shifted to come
 * within reach of `other`: {0, 0} for an open axis. */
struct box_images { int first[3], last[3]; };
struct box_images box_images(const struct box *box, const double own[2][3], const double other[2][3]);
/* Takes the sides from the block where nothing is declared (SIM_START). */
void box_read(struct sim *sim);
/* For `box: {}`, sides are those of the file that the rows come from (code units). */
bool box_awaits_file(const struct sim *sim);
void box_from_file(struct sim *sim, const double side[3]);
#endif
