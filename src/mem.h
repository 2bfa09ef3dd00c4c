/* SPDX-License-Identifier: GPL-3.0-or-later
 * Memory, accounted by owner. Blocks are 64-byte aligned; a request that cannot be met ends the
 * program with STATUS_ENVIRONMENT and says who asked for how much, so no caller tests for NULL. */
#ifndef TEPHRA_MEM_H
#define TEPHRA_MEM_H
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

/* owner: a string literal such as "columns", "tree", "gravity". Zeroed. Zero bytes give NULL. */
void *mem_alloc(const char *owner, size_t bytes);
/* Keeps the contents up to the smaller size; new bytes are not cleared. block may be NULL. */
void *mem_resize(const char *owner, void *block, size_t bytes);
void mem_free(void *block);
/* Addresses for `bytes` bytes, of which only those in use are held and counted, page by page: for columns of which a rank
 * has a part. What is in use for the first time is zero. Freed with mem_free; never resized. */
void *mem_reserve(const char *owner, size_t bytes);
/* Bytes [from, to) of a reserved block will be used; no longer be used (whole pages of them are given back). Of any other
 * block: nothing happens. Not from a parallel region. */
void mem_use(void *block, size_t from, size_t to);
void mem_drop(void *block, size_t from, size_t to);
/* A copy of a text, to be freed with mem_free. */
char *mem_text(const char *owner, const char *text);
/* The same of what printf would write. */
char *mem_format(const char *owner, const char *format, ...) __attribute__((format(printf, 2, 3)));
char *mem_vformat(const char *owner, const char *format, va_list arguments)
    __attribute__((format(printf, 2, 0), nonnull));
/* Bytes held now and at the highest since the start, all owners together. Safe from any thread. */
size_t mem_now(void);
size_t mem_peak(void);
/* The highest so far; counts from now on. */
size_t mem_restart_peak(void);
/* The most that the process had in memory, as the system counts it: program and libraries too, and no untouched pages. */
size_t mem_process_peak(void);
/* One line an owner: held now, highest. */
void mem_report(FILE *stream);

#define mem_array(owner, type, count) ((type *)mem_alloc(owner, (size_t)(count) * sizeof(type)))
#endif
