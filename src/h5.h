/* SPDX-License-Identifier: GPL-3.0-or-later
 * The part of HDF5 that tephra uses; h5.c is the one file that includes hdf5.h. Files are written
 * under a temporary name, flushed and renamed by h5_close, so that a kill leaves the last good one.
 * A failure to write (disk full) ends the program with STATUS_ENVIRONMENT; a failure to read
 * returns false with the reason in h5_error. */
#ifndef TEPHRA_H5_H
#define TEPHRA_H5_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct h5;                  /* a file */

struct h5 *h5_create(const char *path);
struct h5 *h5_open(const char *path);   /* NULL with h5_error */
const char *h5_error(void);
void h5_close(struct h5 *file);         /* of a created file: flush, fsync, rename */

/* kind: 'd' double, 'f' float, 'u' uint64, 'i' int32, 'b' uint8: of memory and of the file. */
void h5_group(struct h5 *file, const char *group);
void h5_write(struct h5 *file, const char *path, char kind, int64_t rows, int components, const void *data);
void h5_attr_double(struct h5 *file, const char *object, const char *name, double value);
void h5_attr_int(struct h5 *file, const char *object, const char *name, int64_t value);
void h5_attr_doubles(struct h5 *file, const char *object, const char *name, const double *values, int count);
void h5_attr_uints(struct h5 *file, const char *object, const char *name, const uint64_t *values, int count);
void h5_attr_text(struct h5 *file, const char *object, const char *name, const char *text);

bool h5_exists(struct h5 *file, const char *path);
/* Rows and components of a data set; false if it is not there. */
bool h5_shape(struct h5 *file, const char *path, int64_t *rows, int *components);
/* Converts to the memory kind. */
bool h5_read(struct h5 *file, const char *path, char kind, int64_t rows, int components, void *data);
bool h5_read_attr(struct h5 *file, const char *object, const char *name, double *values, int count);
char *h5_read_attr_text(struct h5 *file, const char *object, const char *name);
/* Calls visit with the name of each link of a group. */
void h5_list(struct h5 *file, const char *group, void (*visit)(const char *name, void *context), void *context);
#endif
