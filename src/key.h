/* SPDX-License-Identifier: GPL-3.0-or-later
 * Morton keys: the bits of three 42-bit integer coordinates interleaved, z lowest. `high` holds the
 * upper 21 bits a dimension (levels 1 to 21 of the octree), `low` the lower 21 (levels 22 to 42). */
#ifndef TEPHRA_KEY_H
#define TEPHRA_KEY_H
#include "hd.h"
#include <stdint.h>

enum { KEY_LEVELS = 42, KEY_HALF = 21 };
struct key { uint64_t high, low; };

/* Spreads 21 bits so that two zero bits follow each. */
HD uint64_t key_spread(uint64_t x)
{
    x = (x | x << 32) & 0x001f00000000ffffULL;
    x = (x | x << 16) & 0x001f0000ff0000ffULL;
    x = (x | x << 8) & 0x100f00f00f00f00fULL;
    x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
    return (x | x << 2) & 0x1249249249249249ULL;
}

HD uint64_t key_interleave(const uint64_t x[3], int shift)
{
    const uint64_t mask = ((uint64_t)1 << KEY_HALF) - 1;
    return key_spread(x[0] >> shift & mask) << 2 | key_spread(x[1] >> shift & mask) << 1
         | key_spread(x[2] >> shift & mask);
}

/* Integer coordinates of a position in the cube of the given corner; scale = 2^42 / side. */
HD void key_grid(const double pos[3], const double corner[3], double scale, uint64_t x[3])
{
    const double top = (double)(((uint64_t)1 << KEY_LEVELS) - 1);
    for (int k = 0; k < 3; k++) {
        double g = (pos[k] - corner[k]) * scale;
        x[k] = (uint64_t)(g < 0 ? 0 : g > top ? top : g);
    }
}

/* Which of the eight children at `level` (1 to 42) a key lies in. */
HD int key_octant(struct key key, int level)
{
    uint64_t half = level <= KEY_HALF ? key.high : key.low;
    int from_top = level <= KEY_HALF ? level : level - KEY_HALF;
    return (int)(half >> (3 * (KEY_HALF - from_top)) & 7);
}
#endif
