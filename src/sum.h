/* SPDX-License-Identifier: GPL-3.0-or-later
 * Compensated sums (Neumaier 1974): what is rounded off each addition is kept beside the sum, so that a total over
 * any number of rows is right to the last digits, in whatever parts threads and ranks have summed it. Not for files
 * compiled with -ffast-math, which would make them plain. */
#ifndef TEPHRA_SUM_H
#define TEPHRA_SUM_H
#include <math.h>

struct sum { double high, low; };   /* {0, 0} at the start */

static inline void sum_add(struct sum *sum, double value)
{
    double total = sum->high + value;
    sum->low += fabs(sum->high) >= fabs(value) ? (sum->high - total) + value : (value - total) + sum->high;
    sum->high = total;
}

static inline double sum_value(const struct sum *sum) { return sum->high + sum->low; }
#endif
