/* SPDX-License-Identifier: GPL-3.0-or-later
 * The table of formats (formats.h). */
#include "formats.h"
#include "gadget2.h"
#include "h5.h"
#include "text_rows.h"
#include <string.h>

const struct format *const formats_list[] = {&gadget2_labelled_format, &gadget2_format, &text_rows_format, NULL};

static const struct format *find(const unsigned char *head, int64_t bytes)
{
    for (const struct format *const *f = formats_list; *f; f++)
        if ((*f)->recognises(head, bytes)) return *f;
    return NULL;
}

/* What is no format known is left to HDF5 to refuse. */
struct h5 *formats_open(const char *path)
{
    static const unsigned char hdf5[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    unsigned char head[FORMATS_HEAD];
    FILE *stream = fopen(path, "rb");
    if (!stream) return h5_open(path);
    int64_t bytes = (int64_t)fread(head, 1, sizeof head, stream);
    bool is_hdf5 = bytes >= 8 && memcmp(head, hdf5, sizeof hdf5) == 0;
    const struct format *format = is_hdf5 ? NULL : find(head, bytes);
    struct h5 *file = format ? h5_scratch(path) : h5_open(path);
    rewind(stream);
    if (format) format->translate(stream, file);
    fclose(stream);
    return file;
}

static bool ends_with(const char *path, const char *ending)
{
    size_t length = strlen(path), tail = strlen(ending);
    return length > tail && strcmp(path + length - tail, ending) == 0;
}

const struct format *formats_of_name(const char *path)
{
    for (const struct format *const *f = formats_list; *f; f++)
        for (const char *const *ending = (*f)->endings; ending && *ending; ending++)
            if (ends_with(path, *ending)) return *f;
    return NULL;
}

bool formats_is_hdf5_name(const char *path) { return ends_with(path, ".hdf5") || ends_with(path, ".h5"); }
