/* SPDX-License-Identifier: GPL-3.0-or-later
 * GADGET-2's binary files (users' guide of GADGET-2, section 6): Fortran records in either byte order, floats or doubles,
 * ids of 4 or 8 bytes. Format 1 has its blocks in a fixed order, format 2 labels each of them. */
#ifndef TEPHRA_GADGET2_H
#define TEPHRA_GADGET2_H
#include "formats.h"

extern const struct format gadget2_format, gadget2_labelled_format;
#endif
