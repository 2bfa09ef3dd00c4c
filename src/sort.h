/* SPDX-License-Identifier: GPL-3.0-or-later
 * Radix sort of keys with the rows they belong to. */
#ifndef TEPHRA_SORT_H
#define TEPHRA_SORT_H
#include <stdint.h>

/* Sorts key[0..n-1] of 64 bits ascending and carries row[] along. */
void sort_keys(uint64_t *key, int32_t *row, int64_t n);
#endif
