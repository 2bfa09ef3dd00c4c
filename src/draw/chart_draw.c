/* SPDX-License-Identifier: GPL-3.0-or-later
 * The picture of a chart: its panels side by side, each with axes, the rows of its series as marks, lines
 * and a legend. Colours by Okabe & Ito (2008), which everybody can tell apart. */
#include "canvas.h"
#include "chart_sheet.h"
#include "fail.h"
#include "mem.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char owner[] = "charts";

enum { CELL_WIDTH = 880, CELL_HEIGHT = 600, LEFT = 92, RIGHT = 24, TOP = 96, BOTTOM = 70, HEAD = 70, MARK = 9 };
enum { COLOURS = 8, SERIES_MAX = 24 };
static const uint32_t background = 0xffffff, ink = 0x202020, faint = 0xdddddd, fainter = 0xf0f0f0, front_colour = 0xc8c8c8;
static const uint32_t colours[COLOURS] = {0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0xe69f00, 0x56b4e9, 0x000000, 0x8c6d31};

struct axis { double low, high; bool linear; double from, to; };    /* log10 of values unless linear; pixels */

struct series { const char *label; bool cited; };

/* A panel on its way: its axes, its series in the order of the rows. */
struct plot {
    const struct chart_sheet *sheet;
    const struct chart_panel *panel;
    struct canvas *canvas;
    double left, top;           /* of its cell of the picture */
    struct axis x, y;
    struct series series[SERIES_MAX]; int n_series;
    double legend;              /* width */
};

/* --- rows --- */

static const char *cell_of(const struct plot *plot, int row, const char *column)
{
    return plot->sheet->row[row].cell[chart_sheet_column(plot->sheet, column)];
}

/* The place of a value on an axis; NAN: not to be drawn. */
static double place(const char *text, bool linear)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || !isfinite(value)) return NAN;
    return linear ? value : value > 0 ? log10(value) : NAN;
}

static bool row_at(const struct plot *plot, int row, double at[2])
{
    const struct chart_panel *panel = plot->panel;
    if (panel->where && strcmp(cell_of(plot, row, panel->where), panel->is) != 0) return false;
    at[0] = place(cell_of(plot, row, panel->x), panel->linear_x);
    at[1] = place(cell_of(plot, row, panel->y), panel->linear_y);
    return isfinite(at[0] + at[1]);
}

/* Rows that others measured are series of their own, by source. */
static struct series series_of(const struct plot *plot, int row)
{
    if (plot->sheet->row[row].cited) return (struct series){cell_of(plot, row, "source"), true};
    return (struct series){plot->panel->series ? cell_of(plot, row, plot->panel->series) : "", false};
}

static int series_number(const struct plot *plot, struct series series)
{
    for (int s = 0; s < plot->n_series; s++)
        if (plot->series[s].cited == series.cited && strcmp(plot->series[s].label, series.label) == 0) return s;
    return -1;
}

static void find_series(struct plot *plot)
{
    const double size = 9;
    for (int r = 0; r < plot->sheet->n; r++) {
        double at[2];
        struct series series = series_of(plot, r);
        if (!row_at(plot, r, at) || series_number(plot, series) >= 0) continue;
        check(plot->n_series < SERIES_MAX);
        plot->series[plot->n_series++] = series;
        if (*series.label) plot->legend = fmax(plot->legend, canvas_text_width(size, series.label) + 44);
    }
}

/* --- axes --- */

static double pixel(const struct axis *axis, double at)
{
    return axis->from + (at - axis->low) / (axis->high - axis->low) * (axis->to - axis->from);
}

static void to_pixels(const struct plot *plot, double at[2])
{
    at[0] = pixel(&plot->x, at[0]);
    at[1] = pixel(&plot->y, at[1]);
}

static void set_axes(struct plot *plot)
{
    struct axis *axis[2] = {&plot->x, &plot->y};
    plot->x = (struct axis){.linear = plot->panel->linear_x, .from = plot->left + LEFT,
                            .to = plot->left + CELL_WIDTH - RIGHT - plot->legend};
    plot->y = (struct axis){.linear = plot->panel->linear_y, .from = plot->top + CELL_HEIGHT - BOTTOM,
                            .to = plot->top + TOP};
    for (int k = 0; k < 2; k++) {
        axis[k]->low = INFINITY;
        axis[k]->high = -INFINITY;
        for (int r = 0; r < plot->sheet->n; r++) {
            double at[2];
            if (!row_at(plot, r, at)) continue;
            axis[k]->low = fmin(axis[k]->low, at[k]);
            axis[k]->high = fmax(axis[k]->high, at[k]);
        }
        if (!isfinite(axis[k]->low)) axis[k]->low = axis[k]->high = 0;
        double margin = 0.06 * (axis[k]->high - axis[k]->low);
        if (margin <= 0) margin = axis[k]->linear ? 0.5 + fabs(axis[k]->low) : 0.5;
        axis[k]->low -= margin;
        axis[k]->high += margin;
    }
}

static void draw_tick(const struct plot *plot, bool across, double at, const char *text)
{
    const struct axis *x = &plot->x, *y = &plot->y, *axis = across ? x : y;
    const double p = pixel(axis, at), size = 9;
    const uint32_t colour = *text ? faint : fainter;
    if (at < axis->low || at > axis->high) return;
    if (across) canvas_line(plot->canvas, (double[2]){p, y->from}, (double[2]){p, y->to}, 1, colour);
    else canvas_line(plot->canvas, (double[2]){x->from, p}, (double[2]){x->to, p}, 1, colour);
    if (across) canvas_text(plot->canvas, (double[2]){p, y->from + 22}, size, CANVAS_MIDDLE, ink, text);
    else canvas_text(plot->canvas, (double[2]){x->from - 8, p + size / 2}, size, CANVAS_RIGHT, ink, text);
}

/* Steps of 1, 2 or 5 times a power of ten, about six of them, on an axis of either kind. */
static void draw_steps(const struct plot *plot, bool across)
{
    const struct axis *axis = across ? &plot->x : &plot->y;
    const double low = axis->linear ? axis->low : pow(10, axis->low), high = axis->linear ? axis->high : pow(10, axis->high);
    const double wish = (high - low) / 6, power = pow(10, floor(log10(wish)));
    const double step = wish >= 5 * power ? 5 * power : wish >= 2 * power ? 2 * power : power;
    for (double k = ceil(low / step); k * step <= high; k++) {
        char text[32];
        snprintf(text, sizeof text, "%g", k * step);
        draw_tick(plot, across, axis->linear ? k * step : log10(k * step), text);
    }
}

/* Decades, of many every second or third; over few decades 2 and 5 too. */
static void draw_decades(const struct plot *plot, bool across)
{
    const struct axis *axis = across ? &plot->x : &plot->y;
    const double range = axis->high - axis->low;
    const int every = 1 + (int)(range / 9);
    char text[32];
    for (int decade = (int)floor(axis->low); decade <= axis->high; decade++)
        for (int m = 1; m < 10; m++) {
            bool label = m == 1 ? decade % every == 0 : range < 1.6 && (m == 2 || m == 5);
            if (m > 1 && every > 1) break;
            double value = m * pow(10, decade);
            *text = '\0';
            if (label && range < 2.5 && value > 1e-3 && value < 1e5) snprintf(text, sizeof text, "%g", value);
            else if (label && m == 1) snprintf(text, sizeof text, "10^%d", decade);
            else if (label) snprintf(text, sizeof text, "%d 10^%d", m, decade);
            draw_tick(plot, across, log10(value), text);
        }
}

static void draw_axes(const struct plot *plot)
{
    const struct axis *x = &plot->x, *y = &plot->y;
    const struct chart_sheet *sheet = plot->sheet;
    for (int across = 0; across < 2; across++) {
        const struct axis *axis = across ? x : y;
        if (axis->linear || axis->high - axis->low < 0.8) draw_steps(plot, across);
        else draw_decades(plot, across);
    }
    canvas_line(plot->canvas, (double[2]){x->from, y->from}, (double[2]){x->to, y->from}, 1.5, ink);
    canvas_line(plot->canvas, (double[2]){x->from, y->from}, (double[2]){x->from, y->to}, 1.5, ink);
    canvas_text(plot->canvas, (double[2]){(x->from + x->to) / 2, y->from + 50}, 10, CANVAS_MIDDLE, ink,
                sheet->column[chart_sheet_column(sheet, plot->panel->x)]);
    canvas_text(plot->canvas, (double[2]){plot->left + 20, y->to - 16}, 10, CANVAS_LEFT, ink,
                sheet->column[chart_sheet_column(sheet, plot->panel->y)]);
    canvas_text(plot->canvas, (double[2]){plot->left + 20, plot->top + 36}, 13, CANVAS_LEFT, ink, plot->panel->title);
}

/* --- what is measured --- */

static uint32_t series_colour(const struct plot *plot, int s)
{
    return plot->series[s].cited ? 0x707070 : colours[s % COLOURS];
}

/* A dot, a square, a triangle, a ring, by eights of series; what others measured: a cross. */
static void draw_mark(const struct plot *plot, int s, const double at[2])
{
    struct canvas *canvas = plot->canvas;
    const uint32_t colour = series_colour(plot, s);
    const double half = 0.5 * MARK, x = at[0], y = at[1];
    if (plot->series[s].cited) {
        canvas_line(canvas, (double[2]){x - half, y - half}, (double[2]){x + half, y + half}, 2, colour);
        canvas_line(canvas, (double[2]){x - half, y + half}, (double[2]){x + half, y - half}, 2, colour);
    } else if (s / COLOURS == 1) {
        canvas_fill(canvas, (int)(x - half), (int)(y - half), MARK, MARK, colour);
    } else if (s / COLOURS == 2) {
        for (double w = 0; w <= MARK; w++)
            canvas_line(canvas, (double[2]){x - w / 2, y - half + w}, (double[2]){x + w / 2, y - half + w}, 1, colour);
    } else {
        canvas_line(canvas, at, at, MARK, colour);
    }
}

static void draw_lines(const struct plot *plot, int s)
{
    double last[2], at[2];
    bool begun = false;
    for (int r = 0; r < plot->sheet->n; r++) {
        if (!row_at(plot, r, at) || series_number(plot, series_of(plot, r)) != s) continue;
        to_pixels(plot, at);
        if (begun) canvas_line(plot->canvas, last, at, 1.5, series_colour(plot, s));
        memcpy(last, at, sizeof last);
        begun = true;
    }
}

static bool beaten(const struct plot *plot, int row, const double at[2])
{
    for (int r = 0; r < plot->sheet->n; r++) {
        double other[2];
        if (r == row || plot->sheet->row[r].cited || !row_at(plot, r, other)) continue;
        if (other[0] <= at[0] && other[1] <= at[1] && (other[0] < at[0] || other[1] < at[1])) return true;
    }
    return false;
}

static int by_x(const void *a, const void *b)
{
    const double *p = a, *q = b;
    return (p[0] > q[0]) - (p[0] < q[0]);
}

/* Pareto's front: no other row has both less x and less y. */
static void draw_front(const struct plot *plot)
{
    double (*front)[2] = mem_alloc(owner, (size_t)(plot->sheet->n + 1) * sizeof *front);
    int n = 0;
    for (int r = 0; r < plot->sheet->n; r++) {
        double at[2];
        if (plot->sheet->row[r].cited || !row_at(plot, r, at) || beaten(plot, r, at)) continue;
        to_pixels(plot, at);
        memcpy(front[n++], at, sizeof at);
    }
    if (n > 1) qsort(front, (size_t)n, sizeof *front, by_x);
    for (int k = 0; k + 1 < n; k++) canvas_line(plot->canvas, front[k], front[k + 1], 7, front_colour);
    mem_free(front);
}

static void draw_legend(const struct plot *plot)
{
    const double left = plot->x.to + 20;
    double at[2] = {left, plot->y.to + 8};
    for (int s = 0; s < plot->n_series; s++) {
        if (!*plot->series[s].label) continue;
        draw_mark(plot, s, at);
        canvas_text(plot->canvas, (double[2]){left + 14, at[1] + 4.5}, 9, CANVAS_LEFT, ink, plot->series[s].label);
        at[1] += 22;
    }
    if (!plot->panel->front) return;
    canvas_line(plot->canvas, (double[2]){left - 6, at[1]}, (double[2]){left + 6, at[1]}, 7, front_colour);
    canvas_text(plot->canvas, (double[2]){left + 14, at[1] + 4.5}, 9, CANVAS_LEFT, ink, "front");
}

static void draw_panel(struct plot *plot)
{
    find_series(plot);
    if (plot->panel->front) plot->legend = fmax(plot->legend, 80);
    set_axes(plot);
    draw_axes(plot);
    if (plot->panel->front) draw_front(plot);
    for (int s = 0; plot->panel->lines && s < plot->n_series; s++) draw_lines(plot, s);
    for (int r = 0; r < plot->sheet->n; r++) {
        double at[2];
        if (!row_at(plot, r, at)) continue;
        to_pixels(plot, at);
        draw_mark(plot, series_number(plot, series_of(plot, r)), at);
    }
    draw_legend(plot);
}

void chart_sheet_draw(const struct chart_sheet *sheet, const char *path)
{
    const int across = sheet->n_panels > 1 ? 2 : 1, down = (sheet->n_panels + across - 1) / across;
    struct canvas *canvas = canvas_new(across * CELL_WIDTH, HEAD + down * CELL_HEIGHT, background);
    char *title = mem_format(owner, "tephra chart %s: %s", sheet->chart->name, sheet->chart->doc);
    double size = fmin(15, 15 * (canvas->width - 40) / canvas_text_width(15, title));
    canvas_text(canvas, (double[2]){20, 44}, size, CANVAS_LEFT, ink, title);
    for (int p = 0; p < sheet->n_panels; p++) {
        struct plot plot = {.sheet = sheet, .panel = &sheet->panel[p], .canvas = canvas,
                            .left = p % across * CELL_WIDTH, .top = HEAD + p / across * CELL_HEIGHT};
        draw_panel(&plot);
    }
    canvas_write(canvas, path);
    canvas_free(canvas);
    mem_free(title);
}
