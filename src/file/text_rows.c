/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reading and writing of rows as text (text_rows.h). */
#include "text_rows.h"
#include "h5.h"
#include "layout.h"
#include "mem.h"
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What a column can be. `component` of the data set; `factor` brings it to what GADGET's files hold. */
struct kind { const char *const names[4]; const char *set; int component, components; double factor; const char *unit; };
enum { SPECIES, TYPE, ID, FIRST_NUMBER };
static const struct kind kinds[] = {
    {{"species"}, "", 0, 1, 1, ""}, {{"type"}, "", 0, 1, 1, ""}, {{"id"}, "ParticleIDs", 0, 1, 1, ""},
    {{"x"}, "Coordinates", 0, 3, 1, "L"}, {{"y"}, "Coordinates", 1, 3, 1, "L"}, {{"z"}, "Coordinates", 2, 3, 1, "L"},
    {{"vx"}, "Velocities", 0, 3, 1, "V"}, {{"vy"}, "Velocities", 1, 3, 1, "V"}, {{"vz"}, "Velocities", 2, 3, 1, "V"},
    {{"m", "mass"}, "Masses", 0, 1, 1, "M"}, {{"u"}, "InternalEnergy", 0, 1, 1, "V^2"},
    {{"T", "temperature"}, "Temperature", 0, 1, 1, "K"}, {{"h"}, "SmoothingLength", 0, 1, 2, "L"},
    {{"rho", "density"}, "Density", 0, 1, 1, "M L^-3"}, {{"metallicity"}, "Metallicity", 0, 1, 1, "1"}};
enum { N_KINDS = sizeof kinds / sizeof *kinds, MOST = 64, NAME = 128 };
static const char spaces[] = " \t\r\n";
static const char utf8_mark[] = "\xef\xbb\xbf";     /* editors begin files with it */

/* Numbers row by row; ids and species are whole numbers in the bits of a double. */
struct rows {
    struct h5 *to;
    int kind[MOST], n_columns;  /* -1: of no use here */
    int64_t n, capacity, line;
    double *value;              /* n_columns a row */
    double time;
    int64_t promised;           /* by the head of phi-GRAPE's files; -1: nothing was */
};

/* --- names --- */

static int find_kind(const char *name)
{
    for (int k = 0; k < N_KINDS; k++)
        for (int a = 0; a < 4 && kinds[k].names[a]; a++)
            if (strcmp(kinds[k].names[a], name) == 0) return k;
    return -1;
}

/* A line and how far it is read. */
struct cursor { const char *at; bool begun; };

/* The next word, without what follows it in brackets (units); nothing between two commas is an empty one. False at the end. */
static bool next_word(struct cursor *line, char word[NAME])
{
    const char *at = line->at + strspn(line->at, spaces);
    const bool after = line->begun && (*at == ',' || *at == ';');
    if (after) at += 1 + strspn(at + 1, spaces);
    const size_t length = strcspn(at, " \t\r\n,;[");
    snprintf(word, NAME, "%.*s", (int)(length < NAME ? length : NAME - 1), at);
    const bool found = *at || after;
    at += length + strspn(at + length, spaces);
    if (*at == '[') at += strcspn(at, "]") + (strchr(at, ']') ? 1 : 0);
    *line = (struct cursor){at, true};
    return found;
}

/* Takes a line as names if it has x, y and z among them. */
static bool take_names(struct rows *rows, const char *line)
{
    char word[NAME];
    bool found[N_KINDS] = {false};
    int n = 0, kind[MOST];
    for (struct cursor at = {line + strspn(line, "# \t"), false}; next_word(&at, word);) {
        if (n == MOST) return h5_refuse(rows->to, "has more than %d columns", MOST);
        kind[n] = find_kind(word);
        if (kind[n] >= 0 && found[kind[n]]) return h5_refuse(rows->to, "names the column %s twice", word);
        if (kind[n] >= 0) found[kind[n]] = true;
        n++;
    }
    if (!found[find_kind("x")] || !found[find_kind("y")] || !found[find_kind("z")]) return false;
    memcpy(rows->kind, kind, sizeof kind);
    rows->n_columns = n;
    return true;
}

/* Columns without names. */
static bool guess_names(struct rows *rows, int columns)
{
    static const char *const usual[] = {"# id m x y z vx vy vz", "# m x y z vx vy vz"};
    if (columns != 7 && columns != 8)
        return h5_refuse(rows->to, "line %lld: %d columns without names: name them in the first line (x,y,z,...), or have 7 (mass, "
                         "position, velocity) or 8 (id before them)", (long long)rows->line, columns);
    return take_names(rows, usual[columns == 7]);
}

/* --- rows --- */

static bool read_species(struct rows *rows, const char *word, double *value)
{
    for (int s = 0; s < N_SPECIES; s++)
        if (strcmp(species_names[s], word) == 0) {
            *value = s;
            return true;
        }
    return h5_refuse(rows->to, "line %lld: there is no species \"%s\": gas, cloud, star or dark", (long long)rows->line, word);
}

static bool read_value(struct rows *rows, int kind, const char *word, double *value)
{
    char *end;
    if (!*word && kind > ID) {      /* a column of another species */
        *value = NAN;
        return true;
    }
    if (kind == SPECIES) return read_species(rows, word, value);
    if (kind == ID) {
        errno = 0;
        uint64_t id = strtoull(word, &end, 10);
        if (errno == ERANGE)
            return h5_refuse(rows->to, "line %lld: the id %s has more than 64 bits", (long long)rows->line, word);
        memcpy(value, &id, sizeof id);
    } else {
        *value = strtod(word, &end);
    }
    if (kind >= 0 && (*end || !*word || (kind == ID && *word == '-')))
        return h5_refuse(rows->to, "line %lld: \"%s\" is not a number for the column %s", (long long)rows->line, word,
                         kinds[kind].names[0]);
    if (kind == TYPE && !(*value >= 0 && *value < LAYOUT_TYPES && *value == floor(*value)))
        return h5_refuse(rows->to, "line %lld: type %s: 0 (gas) to 5", (long long)rows->line, word);
    return true;
}

static bool add_row(struct rows *rows, const char *line)
{
    char word[NAME];
    if (rows->n == rows->capacity) {
        rows->capacity = 2 * rows->capacity + 1024;
        rows->value = mem_resize("files", rows->value, (size_t)(rows->capacity * rows->n_columns) * sizeof(double));
    }
    double *value = rows->value + rows->n * rows->n_columns;
    int n = 0;
    for (struct cursor at = {line, false}; next_word(&at, word); n++)
        if (n < rows->n_columns && !read_value(rows, rows->kind[n], word, &value[n])) return false;
    if (n != rows->n_columns)
        return h5_refuse(rows->to, "line %lld: has %d columns, not %d as those before it", (long long)rows->line, n,
                         rows->n_columns);
    rows->n++;
    return true;
}

static int count_words(const char *line)
{
    char word[NAME];
    int n = 0;
    for (struct cursor at = {line, false}; next_word(&at, word);) n++;
    return n;
}

/* Lines before the first row: names, or phi-GRAPE's three numbers. */
static bool take_head(struct rows *rows, const char *line, int *singles)
{
    const int words = count_words(line);
    char *end;
    const double number = strtod(line, &end);
    if (words == 1 && *singles < 3 && end != line && !end[strspn(end, spaces)]) {
        if (++*singles == 2 && !(number >= 0 && number < 1e15 && number == floor(number)))
            return h5_refuse(rows->to, "line %lld: %g is no number of rows", (long long)rows->line, number);
        if (*singles == 2) rows->promised = (int64_t)number;
        if (*singles == 3) rows->time = number;
        return true;
    }
    if (isalpha((unsigned char)line[strspn(line, " \t\"")])) {
        if (take_names(rows, line)) return true;
        return h5_refuse(rows->to, "line %lld: names columns, but not x, y and z", (long long)rows->line);
    }
    return guess_names(rows, words) && add_row(rows, line);
}

static bool take_line(struct rows *rows, const char *line, int *singles)
{
    if (line[strspn(line, " \t\r\n")] == 0) return true;
    if (*line == '#') {
        if (rows->n == 0) take_names(rows, line);
        return !h5_error(rows->to);
    }
    return rows->n_columns > 0 ? add_row(rows, line) : take_head(rows, line, singles);
}

/* --- to the layout of HDF5 files --- */

static int column_of(const struct rows *rows, int kind)
{
    for (int c = 0; c < rows->n_columns; c++)
        if (rows->kind[c] == kind) return c;
    return -1;
}

/* The type of each row; without a column that tells, all are gas if they have u or a temperature, else stars. */
static int row_type(const struct rows *rows, int64_t i)
{
    const int species = column_of(rows, SPECIES), type = column_of(rows, TYPE);
    const double *row = rows->value + i * rows->n_columns;
    if (species >= 0) return layout_type[(int)row[species]];
    if (type >= 0) return (int)row[type];
    return layout_type[column_of(rows, find_kind("u")) >= 0 || column_of(rows, find_kind("T")) >= 0 ? GAS : STAR];
}

static void store(const struct rows *rows, int type, int64_t n, int kind)
{
    const struct kind *first = &kinds[kind];
    double *values = mem_array("files", double, n * first->components);
    char path[64];
    int64_t to = 0;
    snprintf(path, sizeof path, "PartType%d/%s", type, first->set);
    for (int64_t i = 0; i < rows->n; i++) {
        if (row_type(rows, i) != type) continue;
        for (int k = 0; k < first->components; k++) {
            int c = column_of(rows, kind + k);
            double value = c >= 0 ? rows->value[i * rows->n_columns + c] : 0;
            values[to++] = kind == ID ? value : first->factor * value;
        }
    }
    h5_write(rows->to, path, kind == ID ? 'u' : 'd', n, first->components, values);
    mem_free(values);
}

static bool is_of_gas(int kind)
{
    static const char *const names[] = {"u", "T", "h", "rho"};
    for (int i = 0; i < 4; i++)
        if (kind == find_kind(names[i])) return true;
    return false;
}

static void store_all(const struct rows *rows)
{
    uint64_t count[LAYOUT_TYPES] = {0};
    for (int64_t i = 0; i < rows->n; i++) count[row_type(rows, i)]++;
    h5_group(rows->to, "Header");
    h5_attr_uints(rows->to, "Header", "NumPart_ThisFile", count, LAYOUT_TYPES);
    h5_attr_double(rows->to, "Header", "Time", rows->time);
    for (int t = 0; t < LAYOUT_TYPES; t++) {
        char group[20];
        snprintf(group, sizeof group, "PartType%d", t);
        if (count[t] == 0) continue;
        h5_group(rows->to, group);
        for (int s = 0; s < N_SPECIES; s++)
            if (layout_type[s] == t) h5_attr_text(rows->to, group, "species", species_names[s]);
        for (int k = ID; k < N_KINDS; k++) {
            bool held = kinds[k].component == 0 && column_of(rows, k) >= 0;
            if (held && (t == layout_type[GAS] || !is_of_gas(k))) store(rows, t, (int64_t)count[t], k);
        }
    }
}

static void translate(FILE *stream, struct h5 *to)
{
    struct rows rows = {.to = to, .promised = -1};
    char *line = NULL;
    size_t size = 0;
    int singles = 0;
    bool good = true;
    while (good && getline(&line, &size, stream) >= 0) {
        const bool marked = rows.line++ == 0 && strncmp(line, utf8_mark, strlen(utf8_mark)) == 0;
        good = take_line(&rows, line + (marked ? strlen(utf8_mark) : 0), &singles);
    }
    if (good && rows.n == 0) h5_refuse(to, "has no rows: neither HDF5 nor GADGET-2's binary, and as text it holds no numbers");
    if (good && rows.promised >= 0 && rows.promised != rows.n)
        h5_refuse(to, "is truncated: its second line promises %lld rows, it has %lld", (long long)rows.promised, (long long)rows.n);
    if (!h5_error(to)) store_all(&rows);
    free(line);
    mem_free(rows.value);
}

static bool recognises(const unsigned char *head, int64_t bytes)
{
    for (int64_t i = 0; i < bytes; i++)
        if (head[i] < 0x80 && !isprint(head[i]) && !isspace(head[i])) return false;
    return bytes > 0;
}

/* --- writing --- */

static void put_name(FILE *stream, const struct sim *sim, const struct kind *kind)
{
    char unit[64];
    layout_unit_text(sim->units.physical, kind->unit, unit, sizeof unit);
    fprintf(stream, ",%s", kind->names[0]);
    if (sim->units.physical && strcmp(kind->unit, "1") != 0) fprintf(stream, " [%s]", unit);
}

/* The column of a kind in the program's tables. */
static const struct { int kind; enum column column; } written[] = {
    {3, COLUMN_pos}, {4, COLUMN_pos}, {5, COLUMN_pos}, {6, COLUMN_vel}, {7, COLUMN_vel}, {8, COLUMN_vel}, {9, COLUMN_mass},
    {10, COLUMN_u}, {12, COLUMN_h}, {13, COLUMN_rho}, {14, COLUMN_metals}};
enum { N_WRITTEN = sizeof written / sizeof *written };

static bool is_written(const struct sim *sim, int w)
{
    for (int s = 0; s < N_SPECIES; s++)
        if (sim->species[s].n > 0 && species_column(&sim->species[s], written[w].column)) return true;
    return false;
}

/* A number of a row in the file's units; nothing where the species lacks the column. */
static void put_number(FILE *stream, const struct sim *sim, const struct species *s, int64_t i, int w)
{
    const enum column column = written[w].column;
    const struct column_info *info = &column_table[column];
    const char *data = species_column(s, column);
    const int64_t at = i * info->components + kinds[written[w].kind].component;
    fputc(',', stream);
    if (!data) return;
    double value = info->kind == 'd' ? ((const double *)data)[at] : (double)((const float *)data)[at];
    if (column_is_element(column)) value /= s->mass[i];
    else value *= layout_factor(&sim->units, info->unit);
    fprintf(stream, info->kind == 'd' ? "%.17g" : "%.9g", value);
}

static bool write_rows(FILE *stream, const struct sim *sim)
{
    bool with[N_WRITTEN];
    fprintf(stream, "species,id");
    for (int w = 0; w < N_WRITTEN; w++)
        if ((with[w] = is_written(sim, w))) put_name(stream, sim, &kinds[written[w].kind]);
    fputc('\n', stream);
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            fprintf(stream, "%s,%llu", species_names[s->kind], (unsigned long long)s->id[i]);
            for (int w = 0; w < N_WRITTEN; w++)
                if (with[w]) put_number(stream, sim, s, i, w);
            fputc('\n', stream);
        }
    return !ferror(stream);
}

static const char *const endings[] = {".csv", NULL};

const struct format text_rows_format = {"text", endings, recognises, translate, write_rows};
