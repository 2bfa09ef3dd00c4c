/* SPDX-License-Identifier: GPL-3.0-or-later
 * The log of a run: lines on stderr and, once log_open was called, in log.txt. Only rank 0 writes. */
#ifndef TEPHRA_LOG_H
#define TEPHRA_LOG_H
#include <stdbool.h>

void log_open(const char *path, bool append);
void log_close(void);
/* `silent` ranks (all but 0) write nothing. */
void log_silence(bool silent);
void log_line(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* "warning: ..." ; counted, so that a summary can name the number. */
void log_warning(const char *format, ...) __attribute__((format(printf, 1, 2)));
int log_warnings(void);
/* "tephra: error: ..."; from any rank, silent or not. */
void log_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* log_error for a thread that ends the program next: closes log.txt, and every other thread that logs
 * from now on waits for the end, so that of several failing threads one speaks. */
void log_last(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* A line that a terminal overwrites with the next one; not in log.txt, not when piped. */
void log_progress(const char *format, ...) __attribute__((format(printf, 1, 2)));
#endif
