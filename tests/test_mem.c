/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory by owner: alignment, zeroing, resizing, the owners' sums, threads. */
#include "mem.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static void test_alignment_and_zero(void **state)
{
    (void)state;
    for (size_t bytes = 1; bytes < 3000000; bytes = bytes * 3 + 1) {
        unsigned char *block = mem_alloc("a", bytes);
        assert_int_equal((uintptr_t)block % 64, 0);
        for (size_t i = 0; i < bytes; i++) assert_int_equal(block[i], 0);
        memset(block, 255, bytes);
        mem_free(block);
    }
    assert_null(mem_alloc("a", 0));
    mem_free(NULL);
}

static void test_resize_keeps_contents(void **state)
{
    (void)state;
    uint32_t *block = NULL;
    size_t before = mem_now(), n = 0;
    for (size_t next = 7; next < 4000000; next = next * 2 + 5) {
        block = mem_resize("b", block, next * sizeof *block);
        assert_int_equal((uintptr_t)block % 64, 0);
        for (size_t i = 0; i < n; i++) assert_int_equal(block[i], i * 2654435761u % 4294967296u);
        for (size_t i = n; i < next; i++) block[i] = (uint32_t)(i * 2654435761u);
        n = next;
        assert_int_equal(mem_now() - before, n * sizeof *block);
    }
    for (n /= 3; n > 3; n /= 3) {
        block = mem_resize("c", block, n * sizeof *block);
        for (size_t i = 0; i < n; i++) assert_int_equal(block[i], (uint32_t)(i * 2654435761u));
    }
    assert_null(mem_resize("c", block, 0));
    assert_int_equal(mem_now(), before);
}

static void test_owners(void **state)
{
    (void)state;
    size_t before = mem_now();
    void *x = mem_alloc("tree", 3000000), *y = mem_alloc("tree", 1000000), *z = mem_alloc("columns", 500000);
    assert_int_equal(mem_now() - before, 4500000);
    mem_free(y);
    assert_int_equal(mem_now() - before, 3500000);
    assert_true(mem_peak() >= before + 4500000);
    char text[2000] = "";
    FILE *stream = fmemopen(text, sizeof text, "w");
    mem_report(stream);
    fclose(stream);
    const char *line = strstr(text, "tree");
    assert_non_null(line);
    double now, peak;
    assert_int_equal(sscanf(line, "tree %lf %lf", &now, &peak), 2);
    assert_true(now == 3.0 && peak == 4.0);
    mem_free(x);
    mem_free(z);
    assert_int_equal(mem_now(), before);
}

static void test_threads(void **state)
{
    (void)state;
    size_t before = mem_now();
#pragma omp parallel for num_threads(4)
    for (int i = 0; i < 20000; i++) {
        void *block = mem_alloc(i % 2 ? "odd" : "even", (size_t)(1 + i % 777));
        block = mem_resize("third", block, (size_t)(1 + i % 333));
        mem_free(block);
    }
    assert_int_equal(mem_now(), before);
}

/* A reserved block far larger than the memory: what is in use counts, page by page, and comes zeroed anew. */
static void test_reserve(void **state)
{
    (void)state;
    const size_t before = mem_now(), page = 4096, bytes = (size_t)1 << 36, at = (size_t)1 << 35;
    char *block = mem_reserve("far", bytes);
    assert_int_equal((uintptr_t)block % 64, 0);
    const size_t empty = mem_now();     /* which pages are in use is a bit each */
    assert_true(empty - before <= bytes / page / 8 + 64);
    mem_use(block, at + 10, at + 20);
    mem_use(block, at, at + page);
    assert_int_equal(mem_now(), empty + page);
    block[at + 15] = 'x';
    mem_use(block, at + page - 1, at + page + 1);
    assert_int_equal(mem_now(), empty + 2 * page);
    mem_drop(block, at + 1, at + 3 * page);     /* the first page is dropped in part only */
    assert_int_equal(mem_now(), empty + page);
    assert_int_equal(block[at + 15], 'x');
    mem_drop(block, 0, bytes);
    mem_use(block, at, at + page);
    assert_int_equal(block[at + 15], 0);
    mem_free(block);
    assert_int_equal(mem_now(), before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_alignment_and_zero), cmocka_unit_test(test_resize_keeps_contents),
        cmocka_unit_test(test_owners), cmocka_unit_test(test_threads),
        cmocka_unit_test(test_reserve),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
