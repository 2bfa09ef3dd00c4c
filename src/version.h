/* SPDX-License-Identifier: GPL-3.0-or-later
 * Version and build of the program. */
#ifndef TEPHRA_VERSION_H
#define TEPHRA_VERSION_H
#include <stdio.h>

extern const char version_number[];
/* Version, compiler, what was built in. */
void version_print(FILE *stream);
#endif
