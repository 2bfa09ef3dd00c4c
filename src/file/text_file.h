/* SPDX-License-Identifier: GPL-3.0-or-later
 * A text file that appears whole or not at all: written under a temporary name, flushed and renamed. */
#ifndef TEPHRA_TEXT_FILE_H
#define TEPHRA_TEXT_FILE_H
#include <stdbool.h>
#include <stdio.h>

struct text_file { FILE *stream; char *path, *unfinished; };

/* Whether such a file could be written now, else errno says why; leaves nothing. */
bool text_file_try(const char *path);
/* Opens PATH.tmp. If that fails, stream is NULL and errno says why; text_file_close is due all the same. */
struct text_file text_file_open(const char *path);
/* Gives the file its name; if anything failed returns false, errno says why, and nothing is left behind. */
bool text_file_close(struct text_file *file);
#endif
