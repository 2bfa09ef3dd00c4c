/* SPDX-License-Identifier: GPL-3.0-or-later
 * A part of gpu_check. */
#ifndef TEPHRA_TESTS_GPU_HERMITE_H
#define TEPHRA_TESTS_GPU_HERMITE_H
#include <stdbool.h>

struct device;
/* Prints a line a sum; how many were wrong. time_it: large sets for their rates instead of a small one. */
int gpu_hermite(struct device *device, bool time_it);
#endif
