/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reading and writing of GADGET-2's binary files (gadget2.h). */
#include "gadget2.h"
#include "h5.h"
#include "layout.h"
#include "mem.h"
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER = 256, LABEL = 4, LABEL_RECORD = 8, TYPES = LAYOUT_TYPES };

/* Where numbers stand in the header. */
enum { AT_COUNT = 0, AT_MASS = 24, AT_TIME = 72, AT_REDSHIFT = 80, AT_TOTAL = 96, AT_FILES = 124, AT_BOX = 128,
       AT_LAMBDA = 144, AT_HUBBLE = 152, AT_ENTROPY = 192 };

/* A block: of which types it has rows. `order` is that of format 1; where `needed`, files without it are not whole. */
struct block { const char *label, *set; int components; unsigned types; bool needed, integer; };
enum { ALL = 0x3f, GAS_ONLY = 1, MASSES = ALL + 1 /* of types without a mass in the header */ };
static const struct block blocks[] = {
    {"POS ", "Coordinates", 3, ALL, true, false}, {"VEL ", "Velocities", 3, ALL, true, false},
    {"ID  ", "ParticleIDs", 1, ALL, true, true},  {"MASS", "Masses", 1, MASSES, true, false},
    {"U   ", "InternalEnergy", 1, GAS_ONLY, false, false}, {"RHO ", "Density", 1, GAS_ONLY, false, false},
    {"HSML", "SmoothingLength", 1, GAS_ONLY, false, false}};
enum { N_BLOCKS = sizeof blocks / sizeof *blocks };

struct reader {
    FILE *stream;
    struct h5 *to;
    bool swapped, labelled;
    int64_t count[TYPES];
    double mass[TYPES];
};

/* --- bytes --- */

static void swap(void *values, int64_t n, int bytes)
{
    unsigned char *at = values;
    for (int64_t i = 0; i < n; i++, at += bytes)
        for (int k = 0; k < bytes / 2; k++) {
            unsigned char keep = at[k];
            at[k] = at[bytes - 1 - k];
            at[bytes - 1 - k] = keep;
        }
}

static uint32_t number_at(const unsigned char *from, bool swapped)
{
    uint32_t value;
    memcpy(&value, from, sizeof value);
    if (swapped) swap(&value, 1, sizeof value);
    return value;
}

static double double_at(const struct reader *r, const unsigned char *from)
{
    double value;
    memcpy(&value, from, sizeof value);
    if (r->swapped) swap(&value, 1, sizeof value);
    return value;
}

/* A mark of a record's length; false at the end of the file. */
static bool read_mark(const struct reader *r, uint32_t *length)
{
    unsigned char bytes[4];
    if (fread(bytes, 1, sizeof bytes, r->stream) != sizeof bytes) return false;
    *length = number_at(bytes, r->swapped);
    return true;
}

/* The contents of a record whose first mark was read, for mem_free; NULL if the file ends before or the marks differ. */
static void *read_record(const struct reader *r, uint32_t length, const char *what)
{
    uint32_t again;
    char *data = mem_alloc("files", (size_t)length + 1);
    if (fread(data, 1, length, r->stream) != length || !read_mark(r, &again))
        h5_refuse(r->to, "is truncated: it ends within the block %s", what);
    else if (again != length)
        h5_refuse(r->to, "is damaged: the block %s has %" PRIu32 " bytes by the mark before it, %" PRIu32 " by that behind it",
                  what, length, again);
    else return data;
    mem_free(data);
    return NULL;
}

/* --- reading --- */

static void read_header(struct reader *r, const unsigned char *head)
{
    uint64_t count[TYPES];
    double time = double_at(r, head + AT_TIME), hubble = double_at(r, head + AT_HUBBLE);
    for (int t = 0; t < TYPES; t++) {
        count[t] = number_at(head + AT_COUNT + 4 * t, r->swapped);
        r->count[t] = (int64_t)count[t];
        r->mass[t] = double_at(r, head + AT_MASS + 8 * t);
    }
    h5_group(r->to, "Header");
    h5_attr_uints(r->to, "Header", "NumPart_ThisFile", count, TYPES);
    h5_attr_doubles(r->to, "Header", "MassTable", r->mass, TYPES);
    h5_attr_double(r->to, "Header", "Time", time);
    h5_attr_double(r->to, "Header", "Redshift", double_at(r, head + AT_REDSHIFT));
    h5_attr_double(r->to, "Header", "BoxSize", double_at(r, head + AT_BOX));
    h5_attr_double(r->to, "Header", "OmegaLambda", double_at(r, head + AT_LAMBDA));
    if (hubble != 0) h5_attr_double(r->to, "Header", "HubbleParam", hubble);    /* 0: left empty */
    h5_attr_int(r->to, "Header", "NumFilesPerSnapshot", number_at(head + AT_FILES, r->swapped));
    if (number_at(head + AT_ENTROPY, r->swapped) != 0)
        h5_refuse(r->to, "has entropies in place of internal energies: convert them first");
}

static bool has_rows(const struct reader *r, const struct block *block, int type)
{
    bool member = block->types == MASSES ? r->mass[type] == 0 : (block->types >> type & 1) != 0;
    return member && r->count[type] > 0;
}

static int64_t block_rows(const struct reader *r, const struct block *block)
{
    int64_t rows = 0;
    for (int t = 0; t < TYPES; t++) rows += has_rows(r, block, t) ? r->count[t] : 0;
    return rows;
}

/* Gives each type its part of a block. */
static void store(const struct reader *r, const struct block *block, char *data, int bytes)
{
    if (r->swapped) swap(data, block_rows(r, block) * block->components, bytes);
    for (int t = 0; t < TYPES; t++) {
        char path[64];
        int64_t rows = r->count[t];
        if (!has_rows(r, block, t)) continue;
        snprintf(path, sizeof path, "PartType%d", t);
        if (!h5_exists(r->to, path)) h5_group(r->to, path);
        snprintf(path, sizeof path, "PartType%d/%s", t, block->set);
        uint64_t *wide = block->integer && bytes == 4 ? mem_array("files", uint64_t, rows) : NULL;
        for (int64_t i = 0; wide && i < rows; i++) wide[i] = number_at((unsigned char *)data + 4 * i, false);
        const char kind = block->integer ? 'u' : bytes == 4 ? 'f' : 'd';
        h5_write(r->to, path, kind, rows, block->components, wide ? (const void *)wide : data);
        mem_free(wide);
        data += rows * block->components * bytes;
    }
}

/* Reads a record as that block. */
static void take_block(const struct reader *r, const struct block *block, uint32_t length)
{
    const int64_t numbers = block_rows(r, block) * block->components;
    const int bytes = numbers > 0 && length == 8 * numbers ? 8 : 4;
    char *data = read_record(r, length, block->label);
    if (data && (int64_t)length != numbers * bytes)
        h5_refuse(r->to, "is damaged: the block %s has %" PRIu32 " bytes; the header's rows need %" PRId64 " or %" PRId64,
                  block->label, length, 4 * numbers, 8 * numbers);
    else if (data) store(r, block, data, bytes);
    mem_free(data);
}

static const struct block *find_block(const char *label)
{
    for (int b = 0; b < N_BLOCKS; b++)
        if (memcmp(blocks[b].label, label, LABEL) == 0) return &blocks[b];
    return NULL;
}

/* The label of the next block; false at the end of the file. */
static bool read_label(const struct reader *r, char label[LABEL + 1])
{
    uint32_t length;
    if (!read_mark(r, &length)) return false;
    char *data = length == LABEL_RECORD ? read_record(r, length, "label") : NULL;
    if (length != LABEL_RECORD)
        h5_refuse(r->to, "is damaged: a label of %" PRIu32 " bytes stands where one of 8 is due", length);
    if (data) memcpy(label, data, LABEL);
    mem_free(data);
    return data != NULL;
}

static void read_blocks(struct reader *r)
{
    bool seen[N_BLOCKS] = {false};
    uint32_t length;
    for (int next = 0; !h5_error(r->to); next++) {
        char label[LABEL + 1] = "";
        while (!r->labelled && next < N_BLOCKS && block_rows(r, &blocks[next]) == 0) next++;
        if (r->labelled ? !read_label(r, label) : next >= N_BLOCKS) break;
        const struct block *block = r->labelled ? find_block(label) : &blocks[next];
        if (!read_mark(r, &length)) break;
        if (block) {
            take_block(r, block, length);
            seen[block - blocks] = true;
        } else {
            mem_free(read_record(r, length, label));    /* of no use here */
        }
    }
    for (int b = 0; b < N_BLOCKS && !h5_error(r->to); b++)
        if (blocks[b].needed && !seen[b] && block_rows(r, &blocks[b]) > 0)
            h5_refuse(r->to, "is truncated: it has no block %s", blocks[b].label);
}

static void translate(FILE *stream, struct h5 *to)
{
    struct reader r = {.stream = stream, .to = to};
    unsigned char first[4];
    uint32_t length = 0;
    char label[LABEL + 1] = "";
    if (fread(first, 1, sizeof first, stream) == sizeof first) length = number_at(first, false);
    r.swapped = length != HEADER && length != LABEL_RECORD;
    rewind(stream);
    r.labelled = number_at(first, r.swapped) == LABEL_RECORD;
    if (r.labelled && !read_label(&r, label)) return;
    if (!read_mark(&r, &length) || length != HEADER) {
        h5_refuse(to, "is damaged: its header has not 256 bytes");
        return;
    }
    unsigned char *head = read_record(&r, length, "HEAD");
    if (head) read_header(&r, head);
    mem_free(head);
    if (!h5_error(to)) read_blocks(&r);
}

static bool begins_with(const unsigned char *head, int64_t bytes, uint32_t length)
{
    return bytes >= LABEL_RECORD && (number_at(head, false) == length || number_at(head, true) == length);
}

static bool recognises(const unsigned char *head, int64_t bytes) { return begins_with(head, bytes, HEADER); }

static bool recognises_labelled(const unsigned char *head, int64_t bytes)
{
    return begins_with(head, bytes, LABEL_RECORD) && memcmp(head + 4, "HEAD", LABEL) == 0;
}

/* --- writing: floats, ids of 4 bytes where they fit --- */

static bool put(FILE *stream, const void *data, size_t bytes) { return fwrite(data, 1, bytes, stream) == bytes; }

static bool put_record(FILE *stream, const char *label, const void *data, int64_t bytes)
{
    const uint32_t mark = (uint32_t)bytes, eight = LABEL_RECORD, next = mark + 8;
    if (bytes > UINT32_MAX - 8)
        fail(STATUS_INPUT, "a block of GADGET-2's binary files holds 4 GB, %s would take %" PRId64 " bytes: write HDF5",
             *label ? label : "this one", bytes);
    bool named = put(stream, &eight, *label ? 4 : 0) && put(stream, label, *label ? LABEL : 0)
              && put(stream, &next, *label ? 4 : 0) && put(stream, &eight, *label ? 4 : 0);
    return named && put(stream, &mark, 4) && put(stream, data, (size_t)bytes) && put(stream, &mark, 4);
}

/* The species of a type in files. */
static const struct species *species_of(const struct sim *sim, int type)
{
    for (int s = 0; s < N_SPECIES; s++)
        if (layout_type[s] == type) return &sim->species[s];
    return NULL;
}

static const enum column block_column[N_BLOCKS] = {COLUMN_pos, COLUMN_vel, COLUMN_id, COLUMN_mass, COLUMN_u, COLUMN_rho, COLUMN_h};

/* Numbers of one column in the file's units, as floats or ids; returns how many bytes. */
static int64_t gather(const struct sim *sim, const struct species *table, int b, int id_bytes, char *to)
{
    const enum column column = block_column[b];
    const struct column_info *info = &column_table[column];
    const char *from = species_column(table, column);
    const double factor = layout_factor(&sim->units, info->unit) * (column == COLUMN_h ? 2 : 1);
    const int bytes = blocks[b].integer ? id_bytes : (int)sizeof(float);
    for (int64_t i = 0; i < table->n * info->components; i++, to += bytes) {
        double wide = info->kind == 'd' ? ((const double *)from)[i] : info->kind == 'f' ? (double)((const float *)from)[i] : 0;
        float narrow = (float)(factor * wide);
        uint32_t short_id = blocks[b].integer ? (uint32_t)table->id[i] : 0;
        const void *value = !blocks[b].integer ? (const void *)&narrow : bytes == 4 ? (const void *)&short_id : &table->id[i];
        memcpy(to, value, (size_t)bytes);
    }
    return table->n * info->components * bytes;
}

static bool put_block(FILE *stream, const struct sim *sim, int b, bool labelled, int id_bytes)
{
    int64_t numbers = 0, bytes = 0;
    const unsigned types = blocks[b].types == MASSES ? ALL : blocks[b].types;
    for (int t = 0; t < TYPES; t++) {
        const struct species *table = types >> t & 1 ? species_of(sim, t) : NULL;
        if (table && table->n > 0 && !species_column(table, block_column[b])) return true;     /* nothing knows them */
        if (table) numbers += table->n * blocks[b].components;
    }
    if (numbers == 0) return true;
    char *data = mem_alloc("files", (size_t)numbers * sizeof(uint64_t));
    for (int t = 0; t < TYPES; t++) {
        const struct species *table = types >> t & 1 ? species_of(sim, t) : NULL;
        if (table && table->n > 0) bytes += gather(sim, table, b, id_bytes, data + bytes);
    }
    bool written = put_record(stream, labelled ? blocks[b].label : "", data, bytes);
    mem_free(data);
    return written;
}

static bool write_file(FILE *stream, const struct sim *sim, bool labelled)
{
    char head[HEADER] = {0};
    const double time = timeline_now(&sim->time) * layout_factor(&sim->units, "L V^-1"), one = 1;
    const double box = box_cubic(&sim->box) ? sim->box.side[0] * layout_factor(&sim->units, "L") : 0;
    const int32_t files = 1;
    int id_bytes = 4;
    for (int t = 0; t < TYPES; t++) {
        const struct species *table = species_of(sim, t);
        const uint32_t n = table ? (uint32_t)table->n : 0;
        memcpy(head + AT_COUNT + 4 * t, &n, sizeof n);
        memcpy(head + AT_TOTAL + 4 * t, &n, sizeof n);
        for (int64_t i = 0; table && i < table->n; i++) if (table->id[i] > UINT32_MAX) id_bytes = 8;
    }
    memcpy(head + AT_TIME, &time, sizeof time);
    memcpy(head + AT_FILES, &files, sizeof files);
    memcpy(head + AT_BOX, &box, sizeof box);
    memcpy(head + AT_HUBBLE, &one, sizeof one);
    bool written = put_record(stream, labelled ? "HEAD" : "", head, sizeof head);
    for (int b = 0; b < N_BLOCKS && written; b++) written = put_block(stream, sim, b, labelled, id_bytes);
    return written;
}

static bool write_plain(FILE *stream, const struct sim *sim) { return write_file(stream, sim, false); }
static bool write_labelled(FILE *stream, const struct sim *sim) { return write_file(stream, sim, true); }

static const char *const plain_endings[] = {".gadget", ".gadget1", NULL}, *const labelled_endings[] = {".gadget2", NULL};

const struct format gadget2_format = {"GADGET-2 binary, format 1", plain_endings, recognises, translate, write_plain};
const struct format gadget2_labelled_format = {"GADGET-2 binary, format 2", labelled_endings, recognises_labelled, translate,
                                               write_labelled};
