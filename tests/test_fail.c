/* SPDX-License-Identifier: GPL-3.0-or-later
 * Errors: what is printed, exit statuses, the nearest name; and the log. */
#include "fail.h"
#include "log.h"
#include "mem.h"
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

/* AddressSanitizer would end the program where malloc returns NULL. */
const char *__asan_default_options(void);
const char *__asan_default_options(void) { return "allocator_may_return_null=1"; }

/* Runs `action` in a child; its stderr goes to text. Returns the exit status, or -1 for a signal. */
static int run_child(void (*action)(void), char *text, size_t room)
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        close(ends[0]);
        action();
        _exit(99);
    }
    close(ends[1]);
    size_t length = 0;
    for (ssize_t got; (got = read(ends[0], text + length, room - 1 - length)) > 0;) length += (size_t)got;
    text[length] = '\0';
    close(ends[0]);
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void do_fail(void) { (fail)(STATUS_ENVIRONMENT, "disk of %d MB full", 7); }
static void do_check(void) { check(1 + 1 == 3); }
static void do_nothing(void) { check(1 + 1 == 2); problems_report(&(struct problems){0, NULL}); }
static void do_memory(void) { mem_alloc("tree", (size_t)1 << 60); }
static void do_problems(void)
{
    struct problems problems = {0, NULL};
    problems_add(&problems, "a.yml:%d: first", 3);
    problems_add(&problems, "a.yml:%d: second", 4);
    problems_report(&problems);
}
static void do_threads(void)
{
#pragma omp parallel num_threads(4)
    (fail)(STATUS_NUMBERS, "one of four");
}

static void test_status(void **state)
{
    (void)state;
    char text[4096];
    assert_int_equal(run_child(do_fail, text, sizeof text), 5);
    assert_string_equal(text, "tephra: error: disk of 7 MB full\n");
    assert_int_equal(run_child(do_check, text, sizeof text), 1);
    assert_non_null(strstr(text, "test_fail.c:"));
    assert_non_null(strstr(text, "1 + 1 == 3"));
    assert_int_equal(run_child(do_nothing, text, sizeof text), 99);
    assert_string_equal(text, "");
    assert_int_equal(run_child(do_memory, text, sizeof text), 5);
    assert_non_null(strstr(text, "out of memory: tree asked for"));
    assert_int_equal(run_child(do_problems, text, sizeof text), 2);
    assert_string_equal(text, "tephra: error: 2 problems:\na.yml:3: first\na.yml:4: second\n");
    for (int trial = 0; trial < 50; trial++) {  /* a race has to be run more than once */
        assert_int_equal(run_child(do_threads, text, sizeof text), 3);
        assert_string_equal(text, "tephra: error: one of four\n");
    }
}

static void test_nearest(void **state)
{
    (void)state;
    const char *const names[] = {"neighbours", "softening", "softening_kernel", "accuracy", "G", "end"};
    const int count = sizeof names / sizeof *names;
    const char *const near[][2] = {
        { "neigbours", "neighbours" }, { "Neighbours", "neighbours" }, { "neighbors", "neighbours" },
        { "nieghbours", "neighbours" }, { "soft", "softening" }, { "eps", NULL }, { "acuracy", "accuracy" },
        { "g", "G" }, { "temperature", NULL }, { "edn", "end" }, { "softeningkernel", "softening_kernel" },
    };
    for (size_t i = 0; i < sizeof near / sizeof *near; i++) {
        const char *found = fail_nearest(near[i][0], names, count);
        if (near[i][1]) assert_string_equal(found, near[i][1]);
        else if (found) fail_msg("\"%s\" found \"%s\"", near[i][0], found);
    }
    char longer[500];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    assert_null(fail_nearest(longer, names, count));
    assert_null(fail_nearest("", names, count));
}

static void do_log(void)
{
    char path[] = "/tmp/tephra-test-log-XXXXXX", text[4096] = "";
    close(mkstemp(path));
    log_open(path, false);
    log_line("line %d", 1);
    log_progress("42 %%");
    log_warning("near %s", "the edge");
    log_silence(true);
    log_line("unseen");
    if (log_warnings() != 1) _exit(1);
    log_silence(false);
    log_close();
    log_open(path, true);
    log_line("again");
    log_close();
    FILE *file = fopen(path, "r");
    size_t got = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    unlink(path);
    _exit(got > 0 && strcmp(text, "line 1\nwarning: near the edge\nagain\n") == 0 ? 0 : 2);
}

static void test_log(void **state)
{
    (void)state;
    char text[4096];
    assert_int_equal(run_child(do_log, text, sizeof text), 0);
    assert_string_equal(text, "line 1\nwarning: near the edge\nagain\n");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_status), cmocka_unit_test(test_nearest), cmocka_unit_test(test_log),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
