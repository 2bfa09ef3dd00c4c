/* SPDX-License-Identifier: GPL-3.0-or-later
 * One row's search for the radius that holds as many rows as wanted, shared by the loops of the CPU (rows in
 * lanes) and of a device (a row a thread). Each turn looks at the rows in reach once. The exact count brackets the
 * distance of the n-th row by values that occur, so that it ends whatever the distances are; the sum of kernels is
 * brought to its target by Newton's steps within a bracket. */
#ifndef TEPHRA_SPH_SEARCH_H
#define TEPHRA_SPH_SEARCH_H
#include "hd.h"
#include <math.h>
#include <stdbool.h>

/* A squared distance that no row has; infinity is not to be had under -ffast-math. */
#define SPH_FAR 3e38f

/* at: where the next turn looks; radius2: the result, once it is not open. */
struct sph_bracket { float low, high, at, radius2; bool open, found; };

/* How many squared distances lie below `at`, the largest of those, and the smallest of the others. */
struct sph_split { float count, below, above; };

HD float sph_larger(float a, float b) { return a > b ? a : b; }
HD float sph_smaller(float a, float b) { return a < b ? a : b; }

/* Where to look next between low (not enough) and high (enough, or the limit): where Newton's step
 * leads, or the middle, which is taken every third time so that the bracket shrinks in any case. */
HD float sph_next_try(float newton, float low, float high, int round)
{
    float middle = low + 0.5f * (high - low);
    if (newton > low && newton < high && round % 3 > 0) return newton;
    return middle > low ? middle : high;
}

/* Where nothing is known: the radius that would hold the target if a cell of that extent and so many rows were uniform. */
HD float sph_guess_reach(float extent, float target, float count)
{
    return extent > 0.0f ? extent * cbrtf(0.75f / 3.14159265f * target / count) : 1.0f;
}

/* guess, limit: squared radii; rows are known within the limit. */
HD struct sph_bracket sph_exact_begin(float guess, float limit)
{
    struct sph_bracket b = {0.0f, limit, sph_smaller(guess, limit), SPH_FAR, true, false};
    return b;
}

/* target: number of rows; nearest: the smallest squared distance that is not 0. */
HD void sph_exact_turn(struct sph_bracket *b, struct sph_split s, float target, float nearest, int round)
{
    bool enough = s.count >= target, last = s.count == (enough ? target : target - 1.0f);
    if (enough) b->high = s.below;
    else b->low = s.above;
    b->open = !last && b->low < b->high;
    if (b->open)
        b->at = sph_next_try(b->at + b->at * (target - 0.5f - s.count) / (1.5f * sph_larger(s.count, 1.0f)), b->low, b->high,
                             round);
    else
        b->radius2 = sph_larger(nearest, enough ? b->high : b->low);
}

/* `at` and the bracket are values of h. */
HD struct sph_bracket sph_smooth_begin(float guess, float limit)
{
    float most = 0.5f * sqrtf(limit);
    struct sph_bracket b = {0.0f, most, sph_smaller(0.5f * sqrtf(guess), most), SPH_FAR, true, false};
    return b;
}

/* sum of m_j w pi at h, and h times its derivative; target: the sum wanted. */
HD void sph_smooth_turn(struct sph_bracket *b, float sum, float slope, float target, float nearest, int round)
{
    const float enough = 1e-6f; /* relative: the rounding of the sum */
    float excess = sum - target, h = b->at;
    bool beyond = excess < 0.0f && h >= b->high;
    if (excess < 0.0f) b->low = h;
    else b->high = h;
    b->found |= excess >= 0.0f;
    b->open = !beyond && fabsf(excess) > enough * sum && b->high - b->low > enough * b->high;
    b->radius2 = beyond ? SPH_FAR : sph_larger(nearest, 4.0f * h * h);
    float newton = h - h * excess / sph_larger(slope, 1e-30f);
    b->at = newton >= b->high && !b->found ? b->high : sph_next_try(newton, b->low, b->high, round);
}
#endif
