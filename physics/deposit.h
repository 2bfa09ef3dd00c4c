/* SPDX-License-Identifier: GPL-3.0-or-later
 * Gives mass, momentum, elements and energy to gas rows, conserving each; the kinetic energy that mixing
 * takes becomes heat (doc/manual/feedback.md, section 2). */
#ifndef TEPHRA_DEPOSIT_H
#define TEPHRA_DEPOSIT_H
#include "nearest.h"
#include "random.h"

enum deposit_form {
    DEPOSIT_HEAT,       /* each row its share */
    DEPOSIT_JUMPS,      /* at random whole rows, all with the same probability, each by `rise` */
    DEPOSIT_PUSH        /* radial momentum, as much as the energy allows */
};

/* All in code units; the gas comes from `pos` with velocity vel and no internal energy of its own but `energy`. */
struct deposit {
    double pos[3], vel[3], mass, element[END_ELEMENTS - FIRST_ELEMENT], energy;
    enum deposit_form form;
    double rise;                /* JUMPS: of the specific energy */
    struct random key;          /* JUMPS: draws 0 ... NEAREST_MOST */
    double momentum;            /* PUSH: sum of the rows' radial momenta */
};

/* Whether the place from which the rows were looked for lies within the kernel of one of them. */
bool deposit_reaches(const struct sim *sim, const struct nearest *nearest);
/* Rows in the midst of their step that shall take shorter ones: a woken row looks active, so that they
 * are woken when all else of this step is done; and those that have been pushed, which the tree follows then. */
struct deposit_wishes {
    struct deposit_wish { int32_t row; uint8_t rung; } *list;
    int64_t n, capacity;
    int32_t *moved;
    int64_t n_moved, room;
};

/* Shares of the rows, m_j W(r_j, h)/sum with 2h the distance of the last. Rows in the midst of their step
 * are changed so that their state now is what it would be after the event; those whose new speeds
 * ask for shorter steps are added to `wishes`. Returns the energy that the rows gained: `energy`, or, of JUMPS and
 * PUSH, what came of it. */
double deposit_to_gas(struct sim *sim, const struct deposit *deposit, const struct nearest *nearest,
                    struct deposit_wishes *wishes);
/* Shares of the rows, which sum to 1; equal ones if the kernel reaches nobody. */
void deposit_shares(const struct sim *sim, const struct nearest *nearest, double share[NEAREST_MOST]);
/* Velocity now of a gas row. */
void deposit_velocity(const struct sim *sim, int32_t row, double vel[3]);
/* Gives the rows their shares of a momentum and of heat. */
void deposit_push(struct sim *sim, const struct nearest *nearest, const double impulse[3], double heat,
                  struct deposit_wishes *wishes);
/* Takes mass from the rows, each its share with its velocity, elements and specific energy. drawn: mass, its mean velocity,
 * elements, and kinetic and thermal energy that went with it. */
void deposit_withdraw(struct sim *sim, const struct nearest *nearest, double mass, struct deposit *drawn);
/* By how much the potential energy rises when a mass goes from a row's place to the gas rows, each its share, or, with a mass below
 * 0, the other way: an estimate without bias from two of them, drawn by their shares with the draws of `key` from
 * NEAREST_MOST + 1 on; of a mass of less than 3 % of a gas row mostly 0, seldom that of 3 %. Before the masses change; 0 without
 * gravity. */
double deposit_rise(const struct sim *sim, const struct nearest *nearest, enum species_kind kind, int64_t row, double mass,
                    const struct random *key);
/* In LIMIT, after sph: the tree follows, and rungs become lower. Forgets the wishes. */
void deposit_wake(struct sim *sim, struct deposit_wishes *wishes);
void deposit_free(struct deposit_wishes *wishes);
#endif
