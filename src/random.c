/* SPDX-License-Identifier: GPL-3.0-or-later
 * Random numbers by counter: Threefry 4x64-20 (Salmon, Moraes, Dror & Shaw 2011, SC'11) of the
 * counter (id, tick, draw / 4) under the key (seed, stream). Normal numbers after Box & Muller 1958. */
#include "random.h"
#include <Random123/threefry.h>
#include <math.h>

static const double TWO_PI = 6.283185307179586476925;

uint64_t random_stream(const char *name)
{
    uint64_t hash = 14695981039346656037u;      /* FNV-1a, 64 bits: Fowler, Noll & Vo */
    for (; *name; name++) hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return hash;
}

static threefry4x64_ctr_t random_block(const struct random *key, uint64_t block)
{
    threefry4x64_ctr_t counter = {{key->id, key->tick, block, 0}};
    threefry4x64_key_t cipher = {{key->seed, key->stream, 0, 0}};
    return threefry4x64(counter, cipher);
}

/* The upper 52 bits, half way between two steps: with 53 the largest would round to 1. */
static double unit_interval(uint64_t word)
{
    return ((double)(word >> 12) + 0.5) * 0x1p-52;
}

double random_uniform(const struct random *key, uint64_t draw)
{
    return unit_interval(random_block(key, draw / 4).v[draw % 4]);
}

/* Draws 2 draw and 2 draw + 1, which lie in one block. */
static void uniform_pair(const struct random *key, uint64_t draw, double x[2])
{
    threefry4x64_ctr_t block = random_block(key, draw / 2);
    for (int k = 0; k < 2; k++) x[k] = unit_interval(block.v[2 * (draw % 2) + (uint64_t)k]);
}

double random_normal(const struct random *key, uint64_t draw)
{
    double x[2];
    uniform_pair(key, draw, x);
    return sqrt(-2.0 * log(x[0])) * cos(TWO_PI * x[1]);
}

void random_direction(const struct random *key, uint64_t draw, double unit[3])
{
    double x[2];
    uniform_pair(key, draw, x);
    double z = 1.0 - 2.0 * x[0], flat = sqrt(1.0 - z * z);
    unit[0] = flat * cos(TWO_PI * x[1]);
    unit[1] = flat * sin(TWO_PI * x[1]);
    unit[2] = z;
}
