/* SPDX-License-Identifier: GPL-3.0-or-later
 * Least-significant-digit radix sort, 11 bits a pass. A pass in which all keys share the digit is
 * left out, and so is everything when the keys are in order already (rows stay nearly sorted
 * between two builds of the tree). */
#include "sort.h"
#include "mem.h"
#include <string.h>

enum { DIGIT = 11, BINS = 1 << DIGIT, PASSES = 6 };

static void histogram(const uint64_t *key, int64_t n, int32_t (*count)[BINS])
{
    for (int64_t i = 0; i < n; i++)
        for (int p = 0; p < PASSES; p++) count[p][key[i] >> (p * DIGIT) & (BINS - 1)]++;
}

void sort_keys(uint64_t *key, int32_t *row, int64_t n)
{
    int64_t ordered = 1;
    while (ordered < n && key[ordered - 1] <= key[ordered]) ordered++;
    if (ordered >= n) return;

    uint64_t *other_key = mem_array("sort", uint64_t, n), *from_key = key;
    int32_t *other_row = mem_array("sort", int32_t, n), *from_row = row;
    int32_t (*count)[BINS] = mem_alloc("sort", sizeof *count * PASSES);
    histogram(key, n, count);
    for (int p = 0; p < PASSES; p++) {
        int shift = p * DIGIT;
        if (count[p][from_key[0] >> shift & (BINS - 1)] == n) continue;
        int32_t start = 0;
        for (int b = 0; b < BINS; b++) {
            int32_t rows = count[p][b];
            count[p][b] = start;
            start += rows;
        }
        for (int64_t i = 0; i < n; i++) {
            int32_t to = count[p][from_key[i] >> shift & (BINS - 1)]++;
            other_key[to] = from_key[i];
            other_row[to] = from_row[i];
        }
        uint64_t *k = from_key; from_key = other_key; other_key = k;
        int32_t *r = from_row; from_row = other_row; other_row = r;
    }
    if (from_key != key) {
        memcpy(key, from_key, (size_t)n * sizeof *key);
        memcpy(row, from_row, (size_t)n * sizeof *row);
        other_key = from_key;
        other_row = from_row;
    }
    mem_free(other_key);
    mem_free(other_row);
    mem_free(count);
}
