/* SPDX-License-Identifier: GPL-3.0-or-later
 * HDF5 files, serial (h5.h). Writing stops the program at the first failure; reading remembers it.
 * HDF5's own stack of messages is kept silent: its innermost message becomes part of one sentence. */
#include "h5.h"
#include "fail.h"
#include "mem.h"
#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <libgen.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CHUNK_ROWS = 1 << 16, LONGEST_ATTRIBUTE = 60000 /* HDF5 allows 64 kB */ };

struct h5 {
    hid_t id;
    char *path, *temporary;     /* temporary: NULL when reading */
    int level;                  /* of gzip */
    bool bad;
    char error[512];
    struct { hid_t id; char kind; int components; hsize_t next; } set;  /* being written; next: row */
};

/* --- failures --- */

static herr_t innermost(unsigned n, const H5E_error2_t *entry, void *context)
{
    char *text = context;
    if (n > 0 || !entry->desc) return 0;
    const char *quote = strstr(entry->desc, "error message = '");
    const char *from = quote ? quote + strlen("error message = '") : entry->desc;
    size_t length = quote ? strcspn(from, "'") : strlen(from);
    snprintf(text, 300, "%.*s", (int)length, from);
    return 0;
}

/* Ends the program for a file that cannot be written, and leaves no temporary file behind. */
static _Noreturn void h5_stop(const struct h5 *file, const char *why)
{
    char reason[300] = "";
    if (why) snprintf(reason, sizeof reason, "%s", why);
    else H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, reason);
    if (file->temporary) unlink(file->temporary);
    fail(STATUS_ENVIRONMENT, "cannot write %s: %s", file->path, *reason ? reason : "HDF5 failed");
}

/* An identifier or a status of HDF5 on the writing side. */
static hid_t must(const struct h5 *file, hid_t result)
{
    if (result < 0) h5_stop(file, NULL);
    return result;
}

bool h5_refuse(struct h5 *file, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    if (!file->bad) vsnprintf(file->error, sizeof file->error, format, arguments);
    va_end(arguments);
    file->bad = true;
    return false;
}

const char *h5_error(const struct h5 *file) { return file->bad ? file->error : NULL; }

/* --- files --- */

static struct h5 *h5_new(const char *path, bool writing)
{
    H5dont_atexit();    /* or HDF5 tries once more, at exit, to write to a full disk */
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    struct h5 *file = mem_alloc("files", sizeof *file);
    size_t length = strlen(path) + sizeof ".tmp";
    file->id = -1;
    file->path = mem_alloc("files", length);
    strcpy(file->path, path);
    if (writing) {
        file->temporary = mem_alloc("files", length);
        snprintf(file->temporary, length, "%s.tmp", path);
    }
    return file;
}

/* No locks: files appear whole, by rename, and some parallel file systems know no locks. */
static hid_t h5_access(void)
{
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_file_locking(access, false, true);
    return access;
}

struct h5 *h5_create(const char *path)
{
    struct h5 *file = h5_new(path, true);
    hid_t access = h5_access();
    file->id = H5Fcreate(file->temporary, H5F_ACC_TRUNC, H5P_DEFAULT, access);
    must(file, file->id);
    H5Pclose(access);
    return file;
}

struct h5 *h5_scratch(const char *path)
{
    enum { GROWTH = 1 << 24 };      /* bytes by which it grows */
    struct h5 *file = h5_new(path, false);
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, GROWTH, false);
    file->id = must(file, H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, access));
    H5Pclose(access);
    return file;
}

void h5_compress(struct h5 *file, int level) { file->level = level; }

struct h5 *h5_open(const char *path)
{
    struct h5 *file = h5_new(path, false);
    struct stat status;
    if (stat(path, &status) != 0 || access(path, R_OK) != 0) {
        h5_refuse(file, "cannot be read: %s", strerror(errno));
        return file;
    }
    hid_t access = h5_access();
    if (S_ISDIR(status.st_mode)) {
        h5_refuse(file, "is a folder, not a file");
    } else if (S_ISREG(status.st_mode) && status.st_size == 0) {
        h5_refuse(file, "is empty");
    } else if (!S_ISREG(status.st_mode) || H5Fis_hdf5(path) <= 0) {
        h5_refuse(file, "is not an HDF5 file");
    } else if ((file->id = H5Fopen(path, H5F_ACC_RDONLY, access)) < 0) {
        char reason[300] = "";
        H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, reason);
        h5_refuse(file, "is truncated or damaged (%s)", reason);
    }
    H5Pclose(access);
    return file;
}

static bool sync_path(const char *path)
{
    int descriptor = open(path, O_RDONLY);
    if (descriptor < 0) return false;
    bool done = fsync(descriptor) == 0 || errno == EINVAL; /* a file system without fsync */
    close(descriptor);
    return done;
}

void h5_close(struct h5 *file)
{
    if (file->temporary) {
        must(file, H5Fflush(file->id, H5F_SCOPE_GLOBAL));
        must(file, H5Fclose(file->id));
        if (!sync_path(file->temporary) || rename(file->temporary, file->path) != 0)
            h5_stop(file, strerror(errno));
        sync_path(dirname(file->temporary));    /* the new name; its failure loses only the name */
    } else if (file->id >= 0) {
        H5Fclose(file->id);
    }
    mem_free(file->temporary);
    mem_free(file->path);
    mem_free(file);
}

/* --- writing --- */

static hid_t memory_type(char kind)
{
    switch (kind) {
    case 'd': return H5T_NATIVE_DOUBLE;
    case 'f': return H5T_NATIVE_FLOAT;
    case 'u': return H5T_NATIVE_UINT64;
    case 'i': return H5T_NATIVE_INT32;
    default: return H5T_NATIVE_UINT8;
    }
}

static hid_t file_type(char kind)
{
    switch (kind) {
    case 'd': return H5T_IEEE_F64LE;
    case 'f': return H5T_IEEE_F32LE;
    case 'u': return H5T_STD_U64LE;
    case 'i': return H5T_STD_I32LE;
    default: return H5T_STD_U8LE;
    }
}

void h5_group(struct h5 *file, const char *group)
{
    hid_t links = must(file, H5Pcreate(H5P_LINK_CREATE));
    H5Pset_create_intermediate_group(links, 1);
    must(file, H5Gclose(must(file, H5Gcreate2(file->id, group, links, H5P_DEFAULT, H5P_DEFAULT))));
    H5Pclose(links);
}

/* Without times of creation, so that equal data make equal files. */
static hid_t storage(const struct h5 *file, int64_t rows, int components)
{
    hid_t create = must(file, H5Pcreate(H5P_DATASET_CREATE));
    H5Pset_obj_track_times(create, false);
    if (rows > 0) {
        hsize_t chunk[2] = {rows < CHUNK_ROWS ? (hsize_t)rows : CHUNK_ROWS, (hsize_t)components};
        H5Pset_chunk(create, components > 1 ? 2 : 1, chunk);
        if (file->level > 0) {
            H5Pset_shuffle(create);
            H5Pset_deflate(create, (unsigned)file->level);
        }
        H5Pset_fletcher32(create);
    }
    return create;
}

/* Chunks of which a part is written stay in memory until the next part comes. */
static hid_t set_access(const struct h5 *file)
{
    enum { SLOTS = 521, CHUNK_MOST = CHUNK_ROWS * 3 * 8 };
    hid_t access = must(file, H5Pcreate(H5P_DATASET_ACCESS));
    H5Pset_chunk_cache(access, SLOTS, 2 * CHUNK_MOST, H5D_CHUNK_CACHE_W0_DEFAULT);
    return access;
}

void h5_begin_set(struct h5 *file, const char *path, char kind, int64_t rows, int components)
{
    hsize_t shape[2] = {(hsize_t)rows, (hsize_t)components};
    hid_t space = must(file, H5Screate_simple(components > 1 ? 2 : 1, shape, NULL));
    hid_t create = storage(file, rows, components), access = set_access(file);
    hid_t links = must(file, H5Pcreate(H5P_LINK_CREATE));
    H5Pset_create_intermediate_group(links, 1);
    file->set.id = must(file, H5Dcreate2(file->id, path, file_type(kind), space, links, create, access));
    file->set.kind = kind;
    file->set.components = components;
    file->set.next = 0;
    H5Pclose(links);
    H5Pclose(access);
    H5Pclose(create);
    H5Sclose(space);
}

void h5_add_rows(struct h5 *file, int64_t rows, const void *data)
{
    if (rows == 0) return;
    const hsize_t from[2] = {file->set.next, 0}, shape[2] = {(hsize_t)rows, (hsize_t)file->set.components};
    hid_t memory = must(file, H5Screate_simple(file->set.components > 1 ? 2 : 1, shape, NULL));
    hid_t space = must(file, H5Dget_space(file->set.id));
    must(file, H5Sselect_hyperslab(space, H5S_SELECT_SET, from, NULL, shape, NULL));
    must(file, H5Dwrite(file->set.id, memory_type(file->set.kind), memory, space, H5P_DEFAULT, data));
    file->set.next += (hsize_t)rows;
    H5Sclose(space);
    H5Sclose(memory);
}

void h5_end_set(struct h5 *file) { must(file, H5Dclose(file->set.id)); }

void h5_write(struct h5 *file, const char *path, char kind, int64_t rows, int components, const void *data)
{
    h5_begin_set(file, path, kind, rows, components);
    h5_add_rows(file, rows, data);
    h5_end_set(file);
}

/* count 0: a scalar. */
static void write_attribute(struct h5 *file, const char *object, const char *name, hid_t types[2],
                            int count, const void *data)
{
    hsize_t shape = (hsize_t)count;
    hid_t space = must(file, count > 0 ? H5Screate_simple(1, &shape, NULL) : H5Screate(H5S_SCALAR));
    hid_t owner = must(file, H5Oopen(file->id, object, H5P_DEFAULT));
    hid_t attribute = must(file, H5Acreate2(owner, name, types[1], space, H5P_DEFAULT, H5P_DEFAULT));
    must(file, H5Awrite(attribute, types[0], data));
    must(file, H5Aclose(attribute));
    must(file, H5Oclose(owner));
    H5Sclose(space);
}

void h5_attr_double(struct h5 *file, const char *object, const char *name, double value)
{
    write_attribute(file, object, name, (hid_t[]){H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE}, 0, &value);
}

void h5_attr_int(struct h5 *file, const char *object, const char *name, int64_t value)
{
    write_attribute(file, object, name, (hid_t[]){H5T_NATIVE_INT64, H5T_STD_I64LE}, 0, &value);
}

void h5_attr_doubles(struct h5 *file, const char *object, const char *name, const double *values, int count)
{
    write_attribute(file, object, name, (hid_t[]){H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE}, count, values);
}

void h5_attr_uints(struct h5 *file, const char *object, const char *name, const uint64_t *values, int count)
{
    write_attribute(file, object, name, (hid_t[]){H5T_NATIVE_UINT64, H5T_STD_U64LE}, count, values);
}

/* Of fixed length: yt 4.1 decodes bytes, which is what h5py makes of these only. */
void h5_attr_text(struct h5 *file, const char *object, const char *name, const char *text)
{
    size_t length = strlen(text) < LONGEST_ATTRIBUTE ? strlen(text) : LONGEST_ATTRIBUTE;
    hid_t type = must(file, H5Tcopy(H5T_C_S1));
    H5Tset_size(type, length + 1);
    H5Tset_cset(type, H5T_CSET_UTF8);
    char *copy = mem_alloc("files", length + 1);
    memcpy(copy, text, length);
    write_attribute(file, object, name, (hid_t[]){type, type}, 0, copy);
    mem_free(copy);
    H5Tclose(type);
}

/* --- reading --- */

/* Every link on the way must be there: H5Lexists fails on a missing parent, which is an answer too. */
bool h5_exists(struct h5 *file, const char *path)
{
    return file->id >= 0 && H5Lexists(file->id, path, H5P_DEFAULT) > 0
        && H5Oexists_by_name(file->id, path, H5P_DEFAULT) > 0;
}

static bool attr_exists(struct h5 *file, const char *object, const char *name)
{
    bool root = strcmp(object, "/") == 0;
    return file->id >= 0 && (root || h5_exists(file, object))
        && H5Aexists_by_name(file->id, object, name, H5P_DEFAULT) > 0;
}

bool h5_shape(struct h5 *file, const char *path, int64_t *rows, int *components)
{
    hid_t set = h5_exists(file, path) ? H5Dopen2(file->id, path, H5P_DEFAULT) : -1;
    if (set < 0) return false;
    hid_t space = H5Dget_space(set);
    hsize_t shape[2] = {1, 1};
    int rank = H5Sget_simple_extent_ndims(space);
    bool simple = rank >= 0 && rank <= 2 && H5Sget_simple_extent_dims(space, shape, NULL) >= 0;
    *rows = (int64_t)shape[0];
    *components = (int)shape[1];
    H5Sclose(space);
    H5Dclose(set);
    return simple;
}

char h5_kind(struct h5 *file, const char *path)
{
    hid_t set = h5_exists(file, path) ? H5Dopen2(file->id, path, H5P_DEFAULT) : -1;
    if (set < 0) return 0;
    hid_t type = H5Dget_type(set);
    size_t bytes = H5Tget_size(type);
    char kind = 0;
    if (H5Tget_class(type) == H5T_FLOAT) kind = bytes > sizeof(float) ? 'd' : 'f';
    else if (H5Tget_class(type) == H5T_INTEGER && H5Tget_sign(type) == H5T_SGN_2) kind = 'i';
    else if (H5Tget_class(type) == H5T_INTEGER) kind = bytes > 1 ? 'u' : 'b';
    H5Tclose(type);
    H5Dclose(set);
    return kind;
}

bool h5_read_rows(struct h5 *file, const char *path, char kind, struct h5_part part, int components, void *data)
{
    int64_t there = 0;
    int width = 0;
    if (file->bad) return false;
    if (!h5_shape(file, path, &there, &width)) return h5_refuse(file, "has no data set %s", path);
    if (there != part.all || width != components)
        return h5_refuse(file, "has a data set %s of %lld x %d values where %lld x %d belong", path,
                         (long long)there, width, (long long)part.all, components);
    if (part.rows == 0) return true;
    bool negative = kind == 'u' && h5_kind(file, path) == 'i';    /* may be: HDF5 would make 0 of each */
    const hsize_t from[2] = {(hsize_t)part.first, 0}, shape[2] = {(hsize_t)part.rows, (hsize_t)components};
    hid_t set = H5Dopen2(file->id, path, H5P_DEFAULT), space = H5Dget_space(set);
    hid_t memory = H5Screate_simple(H5Sget_simple_extent_ndims(space), shape, NULL);
    bool done = H5Sselect_hyperslab(space, H5S_SELECT_SET, from, NULL, shape, NULL) >= 0
             && H5Dread(set, negative ? H5T_NATIVE_INT64 : memory_type(kind), memory, space, H5P_DEFAULT, data) >= 0;
    char reason[300] = "";
    if (!done) H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, innermost, reason);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
    return done || h5_refuse(file, "is damaged: %s cannot be read (%s)", path, reason);
}

bool h5_read(struct h5 *file, const char *path, char kind, int64_t rows, int components, void *data)
{
    return h5_read_rows(file, path, kind, (struct h5_part){rows, 0, rows}, components, data);
}

bool h5_read_attr(struct h5 *file, const char *object, const char *name, double *values, int count)
{
    if (!attr_exists(file, object, name)) return false;
    hid_t attribute = H5Aopen_by_name(file->id, object, name, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) return false;
    hid_t space = H5Aget_space(attribute), type = H5Aget_type(attribute);
    H5T_class_t class = H5Tget_class(type);
    int64_t length = H5Sget_simple_extent_npoints(space);
    bool done = (class == H5T_FLOAT || class == H5T_INTEGER) && length >= count;
    if (done) {
        double *all = mem_array("files", double, length);
        done = H5Aread(attribute, H5T_NATIVE_DOUBLE, all) >= 0;
        if (done) memcpy(values, all, (size_t)count * sizeof *values);
        mem_free(all);
    }
    H5Tclose(type);
    H5Sclose(space);
    H5Aclose(attribute);
    return done;
}

static char *variable_text(hid_t attribute, hid_t type)
{
    char *found = NULL;
    if (H5Aread(attribute, type, &found) < 0 || !found) return NULL;
    char *text = mem_alloc("files", strlen(found) + 1);
    strcpy(text, found);
    H5free_memory(found);
    return text;
}

char *h5_read_attr_text(struct h5 *file, const char *object, const char *name)
{
    if (!attr_exists(file, object, name)) return NULL;
    hid_t attribute = H5Aopen_by_name(file->id, object, name, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) return NULL;
    hid_t space = H5Aget_space(attribute), type = H5Aget_type(attribute);
    char *text = NULL;
    if (H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1) {
        if (H5Tis_variable_str(type) > 0) {
            text = variable_text(attribute, type);
        } else {
            text = mem_alloc("files", H5Tget_size(type) + 1);
            H5Aread(attribute, type, text);
        }
    }
    H5Tclose(type);
    H5Sclose(space);
    H5Aclose(attribute);
    return text;
}

struct visitor { void (*visit)(const char *name, void *context); void *context; };

static herr_t visit_link(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
    (void)group;
    (void)info;
    const struct visitor *visitor = context;
    visitor->visit(name, visitor->context);
    return 0;
}

void h5_list(struct h5 *file, const char *group, void (*visit)(const char *name, void *context), void *context)
{
    bool root = strcmp(group, "/") == 0;
    hid_t id = root || h5_exists(file, group) ? H5Gopen2(file->id, group, H5P_DEFAULT) : -1;
    if (id < 0) return;
    struct visitor visitor = {visit, context};
    H5Literate(id, H5_INDEX_NAME, H5_ITER_INC, NULL, visit_link, &visitor);
    H5Gclose(id);
}
