/* SPDX-License-Identifier: GPL-3.0-or-later
 * Version and build of the program; configure sets the texts. */
#include "version.h"
#include "commit.h"
#include "config.h"

const char version_number[] = PACKAGE_VERSION;

void version_print(FILE *stream)
{
    fprintf(stream, "tephra %s (%s)\n  compiler  %s\n  MPI       %s\n  HDF5      %s\n  CUDA      %s\n", PACKAGE_VERSION,
            TEPHRA_COMMIT, BUILD_COMPILER, BUILD_MPI, BUILD_HDF5, BUILD_CUDA);
}
