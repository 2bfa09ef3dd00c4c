/* SPDX-License-Identifier: GPL-3.0-or-later
 * Text files that appear whole (text_file.h). */
#include "text_file.h"
#include "mem.h"
#include <errno.h>
#include <unistd.h>

struct text_file text_file_open(const char *path)
{
    struct text_file file = {.path = mem_text("files", path), .unfinished = mem_format("files", "%s.tmp", path)};
    file.stream = fopen(file.unfinished, "w");
    return file;
}

bool text_file_try(const char *path)
{
    struct text_file file = text_file_open(path);
    const bool possible = file.stream;
    const int why = errno;
    if (possible) fclose(file.stream);
    if (possible) unlink(file.unfinished);
    mem_free(file.unfinished);
    mem_free(file.path);
    errno = why;
    return possible;
}

bool text_file_close(struct text_file *file)
{
    FILE *stream = file->stream;
    int why = errno;
    bool written = stream && !ferror(stream) && fflush(stream) == 0 && fsync(fileno(stream)) == 0;
    if (stream && !written) why = errno;
    if (stream && fclose(stream) != 0 && written) {
        written = false;
        why = errno;
    }
    if (written && rename(file->unfinished, file->path) != 0) {
        written = false;
        why = errno;
    }
    if (stream && !written) unlink(file->unfinished);
    mem_free(file->unfinished);
    mem_free(file->path);
    *file = (struct text_file){0};
    errno = why;
    return written;
}
