/* SPDX-License-Identifier: GPL-3.0-or-later
 * The forms of error. The user's mistakes are collected in `struct problems` and printed together;
 * everything else ends the program at once with one sentence and a fixed exit status. */
#ifndef TEPHRA_FAIL_H
#define TEPHRA_FAIL_H
#include <stdbool.h>

enum status {
    STATUS_DONE = 0,
    STATUS_FAULT = 1,       /* a broken invariant: our fault */
    STATUS_INPUT = 2,       /* scene, file or command line is wrong */
    STATUS_NUMBERS = 3,     /* NaN, a step below the tick, energy beyond its limit */
    STATUS_STOPPED = 4,     /* on request, with a checkpoint */
    STATUS_ENVIRONMENT = 5  /* disk full, out of memory, device lost */
};

/* Prints "tephra: error: ..." on stderr and ends every rank with the given status. */
_Noreturn void fail(enum status status, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* What to do after a failure of the environment: added to the message of a STATUS_ENVIRONMENT. */
void fail_set_advice(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* "; ..." or "" while none is set. */
const char *fail_advice(void);

/* An invariant of the program. Failing it prints file and line and ends with STATUS_FAULT. */
#define check(condition) ((condition) ? (void)0 : fail_check(#condition, __FILE__, __LINE__))
_Noreturn void fail_check(const char *condition, const char *file, int line);

/* The user's mistakes, collected so that all of them are shown at once. */
struct problems {
    int count;
    char *text;             /* one line each */
};
void problems_add(struct problems *problems, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Prints what was collected and ends with STATUS_INPUT; returns if there is nothing. */
void problems_report(struct problems *problems);

/* The entry of `names` (count of them) closest to `word` by edit distance, or NULL if none is near. */
const char *fail_nearest(const char *word, const char *const *names, int count);
#endif
