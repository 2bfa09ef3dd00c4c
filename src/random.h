/* SPDX-License-Identifier: GPL-3.0-or-later
 * Counter-based random numbers (Random123, Threefry 4x64): a pure function of seed, particle id,
 * tick, stream and draw, so that no thread, rank or device changes a run. */
#ifndef TEPHRA_RANDOM_H
#define TEPHRA_RANDOM_H
#include <stdint.h>

struct random { uint64_t seed, id, tick, stream; };
/* stream: hash of a name such as "evrard", "star_formation". */
uint64_t random_stream(const char *name);
/* Uniform in (0, 1), 52 bits, never 0 or 1; `draw` counts the numbers of one (id, tick, stream). */
double random_uniform(const struct random *key, uint64_t draw);
/* Normal with mean 0 and variance 1. Uses draws 2*draw and 2*draw + 1. */
double random_normal(const struct random *key, uint64_t draw);
/* An isotropic unit vector; uses draws 2*draw and 2*draw + 1. */
void random_direction(const struct random *key, uint64_t draw, double unit[3]);
#endif
