/* SPDX-License-Identifier: GPL-3.0-or-later
 * Errors: one sentence and a fixed exit status, or a collected list of the user's mistakes. Nearest
 * names by the optimal-string-alignment distance (Damerau 1964), in which two swapped letters are
 * one mistake. */
#include "fail.h"
#include "comm.h"
#include "log.h"
#include "mem.h"
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char advice[2048];

void fail_set_advice(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    strcpy(advice, "; ");
    vsnprintf(advice + 2, sizeof advice - 2, format, arguments);
    va_end(arguments);
}

const char *fail_advice(void) { return advice; }

/* Ends every rank, after log_last. */
static _Noreturn void end_all(enum status status)
{
    if (comm_size() > 1) comm_abort((int)status);
    exit((int)status);
}

/* A mistake of the user is every rank's: the first has the time to speak for all. */
static void let_first_speak(void)
{
    if (comm_rank() > 0) sleep(2);
}

void fail(enum status status, const char *format, ...)
{
    if (status == STATUS_INPUT) let_first_speak();
    char text[2048];    /* no allocation: memory may be what has run out */
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    log_last("%s%s", text, status == STATUS_ENVIRONMENT ? advice : "");
    end_all(status);
}

void fail_check(const char *condition, const char *file, int line)
{
    fail(STATUS_FAULT, "%s:%d: rank %d: \"%s\" does not hold; this is a fault of tephra, please report it",
         file, line, comm_rank(), condition);
}

void problems_add(struct problems *problems, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *line = mem_vformat("messages", format, arguments);
    va_end(arguments);
    size_t old = problems->text ? strlen(problems->text) : 0, added = strlen(line);
    problems->text = mem_resize("messages", problems->text, old + added + 2);
    memcpy(problems->text + old, line, added);
    memcpy(problems->text + old + added, "\n", 2);
    problems->count++;
    mem_free(line);
}

void problems_report(struct problems *problems)
{
    if (problems->count == 0) return;
    let_first_speak();
    size_t length = strlen(problems->text);
    if (length > 0 && problems->text[length - 1] == '\n') problems->text[length - 1] = '\0';
    if (problems->count == 1)
        log_last("%s", problems->text);
    else
        log_last("%d problems:\n%s", problems->count, problems->text);
    end_all(STATUS_INPUT);
}

enum { LONGEST = 63 };

static int smaller(int a, int b) { return a < b ? a : b; }

static int edit_distance(const char *a, const char *b)
{
    int row[3][LONGEST + 1], na = (int)strlen(a), nb = (int)strlen(b);
    for (int j = 0; j <= nb; j++) row[0][j] = j;
    for (int i = 1; i <= na; i++) {
        int *now = row[i % 3], *last = row[(i + 2) % 3], *before = row[(i + 1) % 3];
        now[0] = i;
        for (int j = 1; j <= nb; j++) {
            int x = tolower((unsigned char)a[i - 1]), y = tolower((unsigned char)b[j - 1]);
            now[j] = smaller(last[j - 1] + (x != y), smaller(last[j], now[j - 1]) + 1);
            if (i > 1 && j > 1 && x == tolower((unsigned char)b[j - 2]) && y == tolower((unsigned char)a[i - 2]))
                now[j] = smaller(now[j], before[j - 2] + 1);
        }
    }
    return row[na % 3][nb];
}

const char *fail_nearest(const char *word, const char *const *names, int count)
{
    const char *nearest = NULL;
    size_t length = strlen(word);
    if (length == 0 || length > LONGEST) return NULL;
    int best = smaller(4, 1 + (int)length / 4);  /* beyond this a guess misleads */
    for (int i = 0; i < count; i++) {
        if (strlen(names[i]) > LONGEST) continue;
        bool start = length >= 3 && strncmp(word, names[i], length) == 0;
        int distance = start ? 1 : edit_distance(word, names[i]);
        if (distance < best || (distance == best && !nearest)) {
            best = distance;
            nearest = names[i];
        }
    }
    return nearest;
}
