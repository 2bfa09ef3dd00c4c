/* SPDX-License-Identifier: GPL-3.0-or-later
 * The part of HDF5 that tephra uses; h5.c is the one file that includes hdf5.h. Files are written
 * under a temporary name, flushed and renamed by h5_close, so that a kill leaves the last good one.
 * A failure to write (disk full) removes the temporary file and ends the program with
 * STATUS_ENVIRONMENT. A failure to read returns false and is kept by the file: h5_error is its first
 * one, so that a caller may read much and ask once. */
#ifndef TEPHRA_H5_H
#define TEPHRA_H5_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct h5;                  /* a file */

struct h5 *h5_create(const char *path);
/* gzip level (with byte shuffle) of the data sets written from here on; 0, the default, is none. */
void h5_compress(struct h5 *file, int level);
struct h5 *h5_open(const char *path);   /* never NULL: ask h5_error */
/* An empty file in memory alone, to be filled and read under the name of another, whose layout is translated. */
struct h5 *h5_scratch(const char *path);
/* From now on it could not be read, for this reason; false. */
bool h5_refuse(struct h5 *file, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Why the file could not be opened or read, as the end of a sentence; NULL if all is well. */
const char *h5_error(const struct h5 *file);
void h5_close(struct h5 *file);         /* of a created file: flush, fsync, rename */

/* kind: 'd' double, 'f' float, 'u' uint64, 'i' int32, 'b' uint8: of memory and of the file.
 * Data sets carry a Fletcher-32 checksum: damage shows as a failure to read. */
void h5_group(struct h5 *file, const char *group);
void h5_write(struct h5 *file, const char *path, char kind, int64_t rows, int components, const void *data);
/* The same of rows that come one part after another; one set at a time. */
void h5_begin_set(struct h5 *file, const char *path, char kind, int64_t rows, int components);
void h5_add_rows(struct h5 *file, int64_t rows, const void *data);
void h5_end_set(struct h5 *file);
void h5_attr_double(struct h5 *file, const char *object, const char *name, double value);
void h5_attr_int(struct h5 *file, const char *object, const char *name, int64_t value);
void h5_attr_doubles(struct h5 *file, const char *object, const char *name, const double *values, int count);
void h5_attr_uints(struct h5 *file, const char *object, const char *name, const uint64_t *values, int count);
void h5_attr_text(struct h5 *file, const char *object, const char *name, const char *text);

bool h5_exists(struct h5 *file, const char *path);
/* Rows and components of a data set; false if it is not there or has more than two dimensions. */
bool h5_shape(struct h5 *file, const char *path, int64_t *rows, int *components);
/* The kind that holds every value of a data set: 'd', 'f', 'u' or 'b'; 'i' stands for all signed
 * integers; 0 for anything else. */
char h5_kind(struct h5 *file, const char *path);
/* Converts to the memory kind; negative numbers read as u keep their 64 bits, and so stay distinct. */
bool h5_read(struct h5 *file, const char *path, char kind, int64_t rows, int components, void *data);
/* The same of rows [first, first + rows) of a data set that has `all` rows. */
struct h5_part { int64_t all, first, rows; };
bool h5_read_rows(struct h5 *file, const char *path, char kind, struct h5_part part, int components, void *data);
/* The first `count` elements of a numeric attribute; false if it is missing or shorter. */
bool h5_read_attr(struct h5 *file, const char *object, const char *name, double *values, int count);
/* Text of an attribute for the caller to mem_free; NULL if it is missing. */
char *h5_read_attr_text(struct h5 *file, const char *object, const char *name);
/* Calls visit with the name of each link of a group, in alphabetical order. */
void h5_list(struct h5 *file, const char *group, void (*visit)(const char *name, void *context), void *context);
#endif
