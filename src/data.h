/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where tables and scenes lie that come with the program. */
#ifndef TEPHRA_DATA_H
#define TEPHRA_DATA_H

/* The path of a file such as "cooling_tables/x.txt", under the first of $TEPHRA_DATA, the installed
 * folder and the source tree that has it: a text to be freed with mem_free. Without one of them the
 * program ends with STATUS_ENVIRONMENT. */
char *data_path(const char *name);
#endif
