/* SPDX-License-Identifier: GPL-3.0-or-later
 * The lookup of data.h. The two folders are written into the program by the build. */
#include "data.h"
#include "fail.h"
#include "mem.h"
#include <stdlib.h>
#include <unistd.h>

char *data_path(const char *name)
{
    const char *const folders[] = {getenv("TEPHRA_DATA"), TEPHRA_DATA_INSTALLED, TEPHRA_DATA_SOURCE};
    for (int i = 0; i < 3; i++) {
        if (!folders[i]) continue;
        char *path = mem_format("data", "%s/%s", folders[i], name);
        if (access(path, R_OK) == 0) return path;
        mem_free(path);
    }
    fail(STATUS_ENVIRONMENT, "%s: neither in %s nor in %s; TEPHRA_DATA may name the folder that holds it",
         name, folders[1], folders[2]);
}
