/* SPDX-License-Identifier: GPL-3.0-or-later
 * The second table of gpu_check: the tree, SPH and whole steps of scenes. */
#ifndef TEPHRA_TESTS_GPU_SCENES_H
#define TEPHRA_TESTS_GPU_SCENES_H
#include <stdbool.h>

struct device;
/* Prints the lines of few rows, or, to time them, those of many. Returns how many failed. */
int gpu_scenes(struct device *device, bool time_it);
#endif
