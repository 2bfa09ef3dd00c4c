/* SPDX-License-Identifier: GPL-3.0-or-later
 * Radix sort of keys: the leading 33 bits by three passes from the least significant digit, then each
 * run of keys that agree in them by insertion or, if it is long, by the next 33 bits in the same way.
 * Keys in order already cost one look (rows stay nearly sorted between two builds of the tree). */
#include "sort.h"
#include "mem.h"
#include <stdbool.h>
#include <string.h>

enum { DIGIT = 11, BINS = 1 << DIGIT, PASSES = 3, INSERTION = 48, TOP_BIT = 64 };

struct rows { uint64_t *key; int32_t *row; };
struct scratch {
    struct rows rows;
    int32_t count[PASSES][BINS];
};

static bool in_order(const uint64_t *key, int64_t n)
{
    for (int64_t i = 1; i < n; i++)
        if (key[i - 1] > key[i]) return false;
    return true;
}

static void insert(uint64_t *key, int32_t *row, int64_t n)
{
    for (int64_t i = 1; i < n; i++) {
        uint64_t k = key[i];
        int32_t r = row[i];
        int64_t at = i;
        for (; at > 0 && key[at - 1] > k; at--) {
            key[at] = key[at - 1];
            row[at] = row[at - 1];
        }
        key[at] = k;
        row[at] = r;
    }
}

/* One pass over the digit at `shift`. */
static void distribute(const struct rows *from, int64_t n, int shift, int32_t *count, struct rows *to)
{
    int32_t start = 0;
    for (int b = 0; b < BINS; b++) {
        int32_t rows = count[b];
        count[b] = start;
        start += rows;
    }
    for (int64_t i = 0; i < n; i++) {
        int32_t at = count[from->key[i] >> shift & (BINS - 1)]++;
        to->key[at] = from->key[i];
        to->row[at] = from->row[i];
    }
}

/* Sorts by the bits below `top`, knowing that all keys agree above. */
static void sort_below(uint64_t *key, int32_t *row, int64_t n, int top, struct scratch *scratch)
{
    if (n <= INSERTION) {
        insert(key, row, n);
        return;
    }
    int low = top - PASSES * DIGIT > 0 ? top - PASSES * DIGIT : 0;
    memset(scratch->count, 0, sizeof scratch->count);
    for (int64_t i = 0; i < n; i++)
        for (int p = 0; p < PASSES; p++) scratch->count[p][key[i] >> (low + p * DIGIT) & (BINS - 1)]++;
    struct rows from = {key, row}, to = scratch->rows;
    for (int p = 0; p < PASSES; p++) {
        int shift = low + p * DIGIT;
        if (scratch->count[p][key[0] >> shift & (BINS - 1)] == n) continue;
        distribute(&from, n, shift, scratch->count[p], &to);
        struct rows other = from;
        from = to;
        to = other;
    }
    if (from.key != key) {
        memcpy(key, from.key, (size_t)n * sizeof *key);
        memcpy(row, from.row, (size_t)n * sizeof *row);
    }
    if (low == 0) return;
    for (int64_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && key[end] >> low == key[i] >> low; end++) {}
        if (end > i + 1) sort_below(key + i, row + i, end - i, low, scratch);
    }
}

void sort_keys(uint64_t *key, int32_t *row, int64_t n)
{
    if (in_order(key, n)) return;
    struct scratch *scratch = mem_alloc("sort", sizeof *scratch);
    scratch->rows.key = mem_array("sort", uint64_t, n);
    scratch->rows.row = mem_array("sort", int32_t, n);
    sort_below(key, row, n, TOP_BIT, scratch);
    mem_free(scratch->rows.key);
    mem_free(scratch->rows.row);
    mem_free(scratch);
}
