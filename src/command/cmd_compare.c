/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra compare`: the data sets of two files, row by row of equal id. Ends with 0 if they are
 * equal (to the last bit, or within --tolerance of the data set's largest number), else with 3. */
#include "cmd.h"
#include "file/formats.h"
#include "file/h5.h"
#include "file/tables.h"
#include "mem.h"
#include "module.h"
#include "sort.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] = "compare A.hdf5 B.hdf5 [--tolerance X]";

struct side { struct h5 *file; const char *path; struct table *table; int n; };

/* Rows of equal id in both tables. */
struct match { const struct table *in[2]; int32_t *a, *b; int64_t n, only_a, only_b; };

struct result { bool differs, inexact; double tolerance; };

static void open_side(struct side *side, const char *path)
{
    *side = (struct side){.file = formats_open(path), .path = path};
    if (h5_error(side->file)) fail(STATUS_INPUT, "%s %s", path, h5_error(side->file));
    side->table = mem_array("files", struct table, TABLES_MOST);
    side->n = tables_find(side->file, side->table);
    if (side->n == 0) fail(STATUS_INPUT, "%s holds no particles", path);
}

static void close_side(struct side *side)
{
    if (h5_error(side->file)) fail(STATUS_INPUT, "%s %s", side->path, h5_error(side->file));
    mem_free(side->table);
    h5_close(side->file);
}

static const struct table *find_table(const struct side *side, const char *group)
{
    for (int t = 0; t < side->n; t++)
        if (strcmp(side->table[t].group, group) == 0) return &side->table[t];
    return NULL;
}

/* Ids in ascending order and the rows they stand in. */
static uint64_t *sorted_ids(struct h5 *file, const struct table *table, int32_t **row)
{
    if (table->rows > INT32_MAX)
        fail(STATUS_INPUT, "%s has %" PRId64 " rows: at most %d can be compared", table->group, table->rows, INT32_MAX);
    uint64_t *id = tables_read_ids(file, table);
    *row = mem_array("files", int32_t, table->rows);
    for (int64_t i = 0; i < table->rows; i++) (*row)[i] = (int32_t)i;
    sort_keys(id, *row, table->rows);
    return id;
}

static struct match match_rows(const struct side *a, const struct table *in_a, const struct side *b,
                               const struct table *in_b)
{
    struct match match = {.in = {in_a, in_b}};
    uint64_t *id_a = sorted_ids(a->file, in_a, &match.a), *id_b = sorted_ids(b->file, in_b, &match.b);
    int64_t i = 0, j = 0;
    while (i < in_a->rows && j < in_b->rows) {
        if (id_a[i] == id_b[j]) {
            match.a[match.n] = match.a[i++];
            match.b[match.n++] = match.b[j++];
        } else if (id_a[i] < id_b[j]) {
            i++;
        } else {
            j++;
        }
    }
    match.only_a = in_a->rows - match.n;
    match.only_b = in_b->rows - match.n;
    mem_free(id_a);
    mem_free(id_b);
    return match;
}

/* Two numbers that are not numbers are equal; one is infinitely far from any other. */
static double difference(double a, double b)
{
    if (a == b || (isnan(a) && isnan(b))) return 0;
    double d = fabs(a - b);
    return isfinite(d) ? d : INFINITY;
}

static void compare_values(const char *name, const struct match *match, int components, double *const value[2],
                           struct result *result)
{
    double largest = 0, worst = 0, squares = 0;
    for (int64_t m = 0; m < match->n; m++)
        for (int k = 0; k < components; k++) {
            double a = value[0][(int64_t)match->a[m] * components + k];
            double d = difference(a, value[1][(int64_t)match->b[m] * components + k]);
            largest = isfinite(a) ? fmax(largest, fabs(a)) : largest;
            worst = fmax(worst, d);
            squares += d * d;
        }
    double count = (double)(match->n * components), rms = count > 0 ? sqrt(squares / count) : 0;
    printf("  %-20s %12.4g %12.4g %12.4g\n", name, worst, rms, largest);
    result->inexact = result->inexact || worst > 0;
    if (!(worst <= result->tolerance * largest)) result->differs = true;
}

static void compare_set(const struct side *a, const struct side *b, const char *name, const struct match *match,
                        struct result *result)
{
    int wide_a = 0, wide_b = 0;
    double *value[2] = {tables_read(a->file, match->in[0], name, &wide_a),
                        tables_read(b->file, match->in[1], name, &wide_b)};
    if (value[0] && value[1] && wide_a == wide_b) {
        compare_values(name, match, wide_a, value, result);
    } else {
        const char *why = !value[1] ? "only in the first" : !value[0] ? "only in the second" : "other shape";
        printf("  %-20s %s\n", name, why);
        result->differs = true;
    }
    mem_free(value[0]);
    mem_free(value[1]);
}

static void compare_tables(const struct side *a, const struct table *in_a, const struct side *b,
                           struct result *result)
{
    const struct table *in_b = find_table(b, in_a->group);
    if (!in_b) {
        printf("%s: only in the first\n", in_a->species);
        result->differs = true;
        return;
    }
    struct match match = match_rows(a, in_a, b, in_b);
    printf("%s: %" PRId64 " rows of equal id\n", in_a->species, match.n);
    if (match.only_a > 0 || match.only_b > 0) {
        printf("  %" PRId64 " rows only in the first, %" PRId64 " only in the second\n", match.only_a, match.only_b);
        result->differs = true;
    }
    printf("  %-20s %12s %12s %12s\n", "data set", "largest diff", "rms diff", "largest");
    for (int i = 0; i < in_a->n_sets; i++)
        if (strcmp(in_a->set[i], in_a->id) != 0)
            compare_set(a, b, in_a->set[i], &match, result);
    for (int i = 0; i < in_b->n_sets; i++)
        if (!tables_has(in_a, in_b->set[i])) compare_set(a, b, in_b->set[i], &match, result);
    mem_free(match.a);
    mem_free(match.b);
}

static void compare_time(const struct side *a, const struct side *b, struct result *result)
{
    double time[2];
    if (!h5_read_attr(a->file, "Header", "Time", &time[0], 1) || !h5_read_attr(b->file, "Header", "Time", &time[1], 1))
        return;
    printf("time: %.17g and %.17g\n", time[0], time[1]);
    result->inexact = result->inexact || time[0] != time[1];
    if (!(difference(time[0], time[1]) <= result->tolerance * fabs(time[0]))) result->differs = true;
}

/* Takes --tolerance out of the arguments; returns how many are left. */
static int take_tolerance(int argc, char **argv, double *tolerance)
{
    int kept = 0;
    for (int i = 0; i < argc; i++) {
        bool joined = strncmp(argv[i], "--tolerance=", strlen("--tolerance=")) == 0;
        if (!joined && strcmp(argv[i], "--tolerance") != 0) {
            argv[kept++] = argv[i];
            continue;
        }
        const char *text = joined ? strchr(argv[i], '=') + 1 : i + 1 < argc ? argv[++i] : "";
        char *end;
        *tolerance = strtod(text, &end);
        if (end == text || *end || !(*tolerance >= 0))
            fail(STATUS_INPUT, "--tolerance %s: must be a number that is not negative", text);
    }
    return kept;
}

static int compare_run(int argc, char **argv)
{
    struct result result = {0};
    struct cmd_options options;
    struct side a, b;
    argc = take_tolerance(argc, argv, &result.tolerance);
    if (!cmd_parse(&options, argc, argv, "", usage)) return STATUS_DONE;
    if (options.n_arguments != 2) fail(STATUS_INPUT, "usage: tephra %s", usage);
    open_side(&a, options.argument[0]);
    open_side(&b, options.argument[1]);
    compare_time(&a, &b, &result);
    for (int t = 0; t < a.n; t++) compare_tables(&a, &a.table[t], &b, &result);
    for (int t = 0; t < b.n; t++)
        if (!find_table(&a, b.table[t].group)) {
            printf("%s: only in the second\n", b.table[t].species);
            result.differs = true;
        }
    close_side(&a);
    close_side(&b);
    if (result.differs) printf("different\n");
    else if (result.inexact) printf("equal within %g\n", result.tolerance);
    else printf("identical\n");
    return result.differs ? STATUS_NUMBERS : STATUS_DONE;
}

const struct command compare_command = {"compare", usage, "differences of two files, row by row", compare_run};
