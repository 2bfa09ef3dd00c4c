/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a chart has filled in, for the command that writes it. */
#ifndef TEPHRA_CHART_SHEET_H
#define TEPHRA_CHART_SHEET_H
#include "chart.h"
#include <stdio.h>

enum { CHART_COLUMNS = 24, CHART_PANELS = 16 };

/* The last column of every file says where a row is from. */
struct chart_cells { char *cell[CHART_COLUMNS]; bool cited; };

struct chart_sheet {
    const struct chart *chart;
    struct chart_common common;
    void *state;                        /* of the chart, from its params */
    char *column[CHART_COLUMNS]; int n_columns;
    struct chart_cells *row; int n;
    struct chart_panel panel[CHART_PANELS]; int n_panels;
    char *notes;
};

struct chart_sheet *chart_sheet_new(const struct chart *chart);
void chart_sheet_free(struct chart_sheet *sheet);
/* Comments about program, machine and parameters, the columns, the rows. */
void chart_sheet_write(struct chart_sheet *sheet, FILE *stream);
/* Number of the column of that name, without its unit. */
int chart_sheet_column(const struct chart_sheet *sheet, const char *name);
/* The panels as a picture (chart_draw.c). */
void chart_sheet_draw(const struct chart_sheet *sheet, const char *path);
#endif
