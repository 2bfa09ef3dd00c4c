/* SPDX-License-Identifier: GPL-3.0-or-later
 * The log: every line goes to stderr and to log.txt. On a terminal a progress line stands below
 * the log and is wiped before the next line is written. */
#include "log.h"
#include "comm.h"
#include "fail.h"
#include <errno.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static struct {
    pthread_mutex_t lock;
    FILE *file;             /* log.txt, or NULL */
    bool silent;
    bool progress;          /* a progress line stands on the terminal */
    int warnings;
} state = {.lock = PTHREAD_MUTEX_INITIALIZER};

static void wipe_progress(void)
{
    if (state.progress) fputs("\r\033[K", stderr);
    state.progress = false;
}

__attribute__((format(printf, 2, 0)))
static void write_line(const char *prefix, const char *format, va_list arguments)
{
    va_list again;
    va_copy(again, arguments);
    wipe_progress();
    fputs(prefix, stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    if (state.file) {
        fputs(prefix, state.file);
        vfprintf(state.file, format, again);
        fputc('\n', state.file);
        fflush(state.file);
    }
    va_end(again);
}

void log_open(const char *path, bool append)
{
    log_close();
    /* One rank empties it: another, a little later, would take away what stands there already. */
    FILE *file = fopen(path, append || comm_rank() > 0 ? "a" : "w");
    if (!file) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    pthread_mutex_lock(&state.lock);
    state.file = file;
    pthread_mutex_unlock(&state.lock);
}

static void close_file(void)
{
    wipe_progress();
    if (state.file) fclose(state.file);
    state.file = NULL;
}

void log_close(void)
{
    pthread_mutex_lock(&state.lock);
    close_file();
    pthread_mutex_unlock(&state.lock);
}

void log_silence(bool silent)
{
    pthread_mutex_lock(&state.lock);
    state.silent = silent;
    pthread_mutex_unlock(&state.lock);
}

void log_line(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    pthread_mutex_lock(&state.lock);
    if (!state.silent) write_line("", format, arguments);
    pthread_mutex_unlock(&state.lock);
    va_end(arguments);
}

void log_warning(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    pthread_mutex_lock(&state.lock);
    state.warnings++;
    if (!state.silent) write_line("warning: ", format, arguments);
    pthread_mutex_unlock(&state.lock);
    va_end(arguments);
}

int log_warnings(void)
{
    pthread_mutex_lock(&state.lock);
    int warnings = state.warnings;
    pthread_mutex_unlock(&state.lock);
    return warnings;
}

__attribute__((format(printf, 1, 0)))
static void write_error(const char *format, va_list arguments)
{
    char prefix[64] = "tephra: error: ";
    if (comm_size() > 1) snprintf(prefix, sizeof prefix, "tephra: error (rank %d): ", comm_rank());
    write_line(prefix, format, arguments);
}

void log_error(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    pthread_mutex_lock(&state.lock);
    write_error(format, arguments);
    pthread_mutex_unlock(&state.lock);
    va_end(arguments);
}

/* The lock stays closed: nothing that this thread still does may log. */
void log_last(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    pthread_mutex_lock(&state.lock);
    write_error(format, arguments);
    close_file();
    va_end(arguments);
}

void log_progress(const char *format, ...)
{
    if (!isatty(STDERR_FILENO)) return;
    va_list arguments;
    va_start(arguments, format);
    pthread_mutex_lock(&state.lock);
    if (!state.silent) {
        wipe_progress();
        vfprintf(stderr, format, arguments);
        fflush(stderr);
        state.progress = true;
    }
    pthread_mutex_unlock(&state.lock);
    va_end(arguments);
}
