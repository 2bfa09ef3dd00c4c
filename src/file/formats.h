/* SPDX-License-Identifier: GPL-3.0-or-later
 * Files of rows that are not HDF5: each format is brought, in memory, to the layout of GADGET's HDF5 files (groups Header
 * and PartType0 to 5), so that one reader (start_file.c) and the commands that look at files know no other. */
#ifndef TEPHRA_FORMATS_H
#define TEPHRA_FORMATS_H
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct h5;
struct sim;

enum { FORMATS_HEAD = 512 };    /* bytes by which a format is told */

struct format {
    const char *name;                       /* "GADGET-2 binary", for messages */
    const char *const *endings;             /* of files that are written so; NULL-ended, or NULL: only read */
    /* Whether a file that begins so is of this format. */
    bool (*recognises)(const unsigned char *head, int64_t bytes);
    /* Fills the scratch file, or h5_refuse with the end of a sentence that begins with the path. */
    void (*translate)(FILE *stream, struct h5 *to);
    /* The rows of a simulation; false if something failed, errno says what. NULL: only read. */
    bool (*write)(FILE *stream, const struct sim *sim);
};
/* The formats, in the order in which they are tried; NULL-ended. */
extern const struct format *const formats_list[];

/* Opens a file of any format; never NULL, ask h5_error. */
struct h5 *formats_open(const char *path);
/* The format that writes files of that name; NULL if none does. */
const struct format *formats_of_name(const char *path);
/* The same, of HDF5 files. */
bool formats_is_hdf5_name(const char *path);
#endif
