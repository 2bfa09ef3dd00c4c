/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gas that is heated while it cools: the time that it takes from one energy to another,
 *     rho t = int du/(Q(u) - g),   g = heating/rho,
 * for any g. Of every block of 2^L segments of a cooling curve two rules of four points are kept: Gauss' for the
 * distribution of 1/Q over du/Q, which serves gas that cools, and for that of Q over du, for gas that warms. A
 * rule is accurate while g keeps off the Q of its block, so that gas strides over decades of temperature and
 * comes down to single segments only near its equilibrium (doc/manual/cooling.md, section 5). */
#ifndef TEPHRA_COOLING_BALANCE_H
#define TEPHRA_COOLING_BALANCE_H

struct cooling_curve;
struct cooling_balance;

struct cooling_balance *cooling_balance_new(const struct cooling_curve *curve);
void cooling_balance_free(struct cooling_balance *balance);
#endif
