/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the walks of gravity and of SPH share on a device: a warp that goes down an octree from the root.
 *
 * A turn takes the children of up to four opened cells from the top of the warp's stack, one child a
 * lane, and judges them; those to be opened go on the stack. The stack holds its entries in the order
 * of their levels, deeper ones on top, and at most 32 of a level: a turn that puts entries of level
 * l + 1 on it has taken what was left of l + 1. So 32 times the levels of the keys is room enough for
 * every tree, and no walk runs over. */
#ifndef TEPHRA_WARP_CUH
#define TEPHRA_WARP_CUH
#include "launch.cuh"
extern "C" {
#include "key.h"
}

enum { LANES = 32, WARP_STACK = LANES * (KEY_LEVELS + 1) };

/* An entry is 8 times the first child of an opened cell, plus the number of its children less one. */
struct warp_stack { uint32_t entry[WARP_STACK]; };

/* Where this lane's entry goes behind n others, if it has one; n becomes the number of all. */
DEVICE int warp_place(int lane, bool mine, int *n)
{
    unsigned votes = __ballot_sync(~0u, mine);
    int place = *n + __popc(votes & ((1u << lane) - 1));
    *n += __popc(votes);
    return place;
}

/* Lanes that open a cell put it on the stack of that depth. */
DEVICE void warp_push(struct warp_stack *stack, int *depth, int lane, bool open, int32_t child,
                                                 int n_children)
{
    int place = warp_place(lane, open, depth);
    if (open) stack->entry[place] = (uint32_t)child << 3 | (uint32_t)(n_children - 1);
}

/* A child of the cells on top of the stack, one a lane, or -1. */
DEVICE int32_t warp_pop(const struct warp_stack *stack, int *depth, int lane)
{
    int taken = min(*depth, LANES / 8), entry = lane / 8, child = lane % 8;
    int32_t cell = -1;
    *depth -= taken;
    if (entry < taken) {
        uint32_t opened = stack->entry[*depth + entry];
        if (child <= (int)(opened & 7)) cell = (int32_t)(opened >> 3) + child;
    }
    __syncwarp();
    return cell;
}

/* The lanes' targets, n of 32 slots or fewer: how many lanes share one (a power of two). */
DEVICE int warp_parts(int n)
{
    int parts = 1;
    while (2 * n * parts <= LANES) parts *= 2;
    return parts;
}

DEVICE float warp_largest(float x)
{
    for (int lanes = LANES / 2; lanes > 0; lanes /= 2) x = fmaxf(x, __shfl_xor_sync(~0u, x, lanes));
    return x;
}
#endif
