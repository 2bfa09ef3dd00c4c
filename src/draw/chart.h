/* SPDX-License-Identifier: GPL-3.0-or-later
 * Charts of accuracy against speed. A chart is a struct in the list of modules.c and lives with the code
 * that it measures; `tephra chart NAME` runs it (cmd_chart.c). It fills a sheet with rows of named
 * columns, which become a CSV file, and describes panels, which draw columns of those rows. */
#ifndef TEPHRA_CHART_H
#define TEPHRA_CHART_H
#include "param.h"
#include <stdbool.h>

struct sim;
struct chart_sheet;

struct chart {
    const char *name, *doc;         /* doc: one line */
    const struct param *params;     /* its keys on the command line, beside those of every chart */
    size_t state_bytes;             /* params fill its fields by offset */
    void (*make)(struct chart_sheet *sheet, const void *state);
};
extern const struct chart *const chart_list[];      /* modules.c; NULL-ended */

/* The keys of every chart. */
struct chart_common { int64_t repeats; };
extern const struct param chart_params[];

/* The tables of a chart's keys, {NULL, NULL} last. */
void chart_targets(const struct chart *chart, struct chart_common *common, void *state, struct param_target targets[3]);
/* How often a time is to be measured; the least is what counts. */
int64_t chart_repeats(const struct chart_sheet *sheet);

/* Names with units, commas between: "scheme,n,cpu [s],error". First of all. */
void chart_columns(struct chart_sheet *sheet, const char *names);
/* A row as CSV has it, one value a column; an empty value or `nan` is not drawn. */
void chart_row(struct chart_sheet *sheet, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A row that others measured: drawn with another mark. `source`: who and where, without a comma. */
void chart_cited(struct chart_sheet *sheet, const char *source, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* A line of the file's head. */
void chart_note(struct chart_sheet *sheet, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* One diagram. Columns are named without their units. Texts are copied. */
struct chart_panel {
    const char *title;
    const char *x, *y;              /* columns of numbers */
    const char *series;             /* column whose values tell series apart, or NULL: one colour each */
    const char *where, *is;         /* only rows whose column `where` holds `is`; NULL: all */
    bool linear_x, linear_y;        /* else logarithmic: numbers that are not positive are left out */
    bool lines;                     /* the rows of a series are joined, in their order */
    bool front;                     /* the measured rows that no other beats in x and y are joined */
};
void chart_panel(struct chart_sheet *sheet, const struct chart_panel *panel);

/* A simulation of a shipped scene ("ics/evrard.yml"), of a file by its absolute path, or of nothing but
 * the assignments, as --set has them (NULL-ended); begun, with its rows, without a run directory. Mistakes
 * end the program with STATUS_INPUT. */
struct sim *chart_sim(const char *scene, const char *const *set);
/* Runs it to its end in silence; CPU seconds, NAN if the numbers failed. */
double chart_run(struct sim *sim);
#endif
