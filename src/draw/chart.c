/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sheet of a chart: columns, rows, head; and simulations that charts run (chart.h). */
#include "chart.h"
#include "chart_sheet.h"
#include "commit.h"
#include "config.h"
#include "data.h"
#include "isa.h"
#include "log.h"
#include "mem.h"
#include "profile.h"
#include "run.h"
#include "start.h"
#include <math.h>
#include <omp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const char owner[] = "charts";

const struct param chart_params[] = {
    {"repeats", PARAM_COUNT, "", "3", 1, 1000, NULL, "how often a time is measured: the least counts", false,
     offsetof(struct chart_common, repeats)},
    {0}
};

void chart_targets(const struct chart *chart, struct chart_common *common, void *state, struct param_target targets[3])
{
    targets[0] = (struct param_target){chart_params, common};
    targets[1] = (struct param_target){chart->params, state};
    targets[2] = (struct param_target){NULL, NULL};
}

#define PANEL_TEXTS(p) {&(p)->title, &(p)->x, &(p)->y, &(p)->series, &(p)->where, &(p)->is}

struct chart_sheet *chart_sheet_new(const struct chart *chart)
{
    struct chart_sheet *sheet = mem_alloc(owner, sizeof *sheet);
    sheet->chart = chart;
    sheet->state = mem_alloc(owner, chart->state_bytes);
    sheet->notes = mem_text(owner, "");
    return sheet;
}

void chart_sheet_free(struct chart_sheet *sheet)
{
    struct param_target targets[3];
    chart_targets(sheet->chart, &sheet->common, sheet->state, targets);
    param_free(targets);
    for (int r = 0; r < sheet->n; r++)
        for (int c = 0; c < sheet->n_columns; c++) mem_free(sheet->row[r].cell[c]);
    for (int c = 0; c < sheet->n_columns; c++) mem_free(sheet->column[c]);
    for (int p = 0; p < sheet->n_panels; p++) {
        const char **const text[] = PANEL_TEXTS(&sheet->panel[p]);
        for (size_t k = 0; k < sizeof text / sizeof *text; k++) mem_free((char *)*text[k]);
    }
    mem_free(sheet->row);
    mem_free(sheet->notes);
    mem_free(sheet->state);
    mem_free(sheet);
}

int64_t chart_repeats(const struct chart_sheet *sheet) { return sheet->common.repeats; }

/* --- rows --- */

/* Splits "a,b,c" into copies; returns their number. */
static int split(const char *text, char *part[CHART_COLUMNS])
{
    char *buffer = mem_text(owner, text);
    int n = 0;
    for (char *next = buffer, *word; (word = strsep(&next, ","));) {
        check(n < CHART_COLUMNS);
        part[n++] = mem_text(owner, word);
    }
    mem_free(buffer);
    return n;
}

void chart_columns(struct chart_sheet *sheet, const char *names)
{
    check(sheet->n_columns == 0);
    char *all = mem_format(owner, "%s,source", names);
    sheet->n_columns = split(all, sheet->column);
    mem_free(all);
}

int chart_sheet_column(const struct chart_sheet *sheet, const char *name)
{
    size_t length = strlen(name);
    for (int c = 0; c < sheet->n_columns; c++)
        if (strncmp(sheet->column[c], name, length) == 0 && (!sheet->column[c][length] || sheet->column[c][length] == ' '))
            return c;
    check(!"a column that the chart has");
    return -1;
}

__attribute__((format(printf, 3, 0)))
static void add_row(struct chart_sheet *sheet, const char *source, const char *format, va_list arguments)
{
    char *values = mem_vformat(owner, format, arguments);
    char *all = mem_format(owner, "%s,%s", values, source ? source : "measured");
    sheet->row = mem_resize(owner, sheet->row, (size_t)(sheet->n + 1) * sizeof *sheet->row);
    struct chart_cells *row = &sheet->row[sheet->n++];
    row->cited = source != NULL;
    check(split(all, row->cell) == sheet->n_columns);
    if (!source) log_line("%s", values);
    mem_free(values);
    mem_free(all);
}

void chart_row(struct chart_sheet *sheet, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_row(sheet, NULL, format, arguments);
    va_end(arguments);
}

void chart_cited(struct chart_sheet *sheet, const char *source, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_row(sheet, source, format, arguments);
    va_end(arguments);
}

void chart_note(struct chart_sheet *sheet, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    char *line = mem_vformat(owner, format, arguments), *all = mem_format(owner, "%s# %s\n", sheet->notes, line);
    va_end(arguments);
    mem_free(line);
    mem_free(sheet->notes);
    sheet->notes = all;
}

void chart_panel(struct chart_sheet *sheet, const struct chart_panel *panel)
{
    check(sheet->n_panels < CHART_PANELS);
    struct chart_panel *own = &sheet->panel[sheet->n_panels++];
    *own = *panel;
    const char **const text[] = PANEL_TEXTS(own);
    for (size_t k = 0; k < sizeof text / sizeof *text; k++)
        if (*text[k]) *text[k] = mem_text(owner, *text[k]);
}

/* --- the file --- */

/* "model name" of the first processor, or what is known without the list of processors. */
static char *processor(void)
{
    FILE *stream = fopen("/proc/cpuinfo", "r");
    char *line = NULL, *name = NULL;
    size_t size = 0;
    while (stream && !name && getline(&line, &size, stream) > 0) {
        char *value = strchr(line, ':');
        if (!value || strncmp(line, "model name", 10) != 0) continue;
        value[strcspn(value, "\n")] = '\0';
        name = mem_text(owner, value + 2);
    }
    free(line);
    if (stream) fclose(stream);
    return name ? name : mem_text(owner, "unknown processor");
}

static void write_head(const struct chart_sheet *sheet, FILE *stream)
{
    char date[64], *name = processor();
    time_t now = time(NULL);
    struct tm calendar;
    double load = NAN;
    gmtime_r(&now, &calendar);
    strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &calendar);
    getloadavg(&load, 1);
    fprintf(stream, "# tephra chart %s: %s\n# program: tephra %s (%s)\n# compiler: %s\n", sheet->chart->name,
            sheet->chart->doc, PACKAGE_VERSION, TEPHRA_COMMIT, BUILD_COMPILER);
    fprintf(stream, "# machine: %s, %d processors, kernels for x86-64-%s, %d threads\n", name, omp_get_num_procs(),
            isa_names[isa_now()], omp_get_max_threads());
    fprintf(stream, "# date: %s, load %.1f\n# parameters, CPU times being the least of `repeats`:\n", date, load);
    mem_free(name);
}

/* The parameters as used.yml has them, behind a #. */
static void write_parameters(struct chart_sheet *sheet, FILE *stream)
{
    struct param_target targets[3];
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (!memory) fail(STATUS_ENVIRONMENT, "out of memory for the parameters of the chart");
    chart_targets(sheet->chart, &sheet->common, sheet->state, targets);
    param_write(memory, targets);
    fclose(memory);
    for (char *next = text, *line; (line = strsep(&next, "\n"));)
        if (*line) fprintf(stream, "# %s\n", line);
    free(text);
}

void chart_sheet_write(struct chart_sheet *sheet, FILE *stream)
{
    write_head(sheet, stream);
    write_parameters(sheet, stream);
    fputs(sheet->notes, stream);
    for (int c = 0; c < sheet->n_columns; c++) fprintf(stream, "%s%s", c ? "," : "", sheet->column[c]);
    fputc('\n', stream);
    for (int r = 0; r < sheet->n; r++) {
        for (int c = 0; c < sheet->n_columns; c++) fprintf(stream, "%s%s", c ? "," : "", sheet->row[r].cell[c]);
        fputc('\n', stream);
    }
}

/* --- runs --- */

struct sim *chart_sim(const char *scene, const char *const *set)
{
    struct problems problems = {0};
    char *path = scene ? *scene == '/' ? mem_text(owner, scene) : data_path(scene) : NULL;
    struct scene *made = path ? scene_read(path, &problems) : scene_new(".");
    problems_report(&problems);
    mem_free(path);
    for (; *set; set++) scene_set(made, *set, &problems);
    problems_report(&problems);
    struct sim *sim = sim_new(made, SIM_RUN);
    problems_report(&sim->problems);
    start_load(sim);
    problems_report(&sim->problems);
    sim_begin(sim);
    problems_report(&sim->problems);
    return sim;
}

double chart_run(struct sim *sim)
{
    double cpu = profile_cpu();
    log_silence(true);
    int status = run_to_end(sim, INFINITY);
    log_silence(false);
    return status == STATUS_DONE ? profile_cpu() - cpu : NAN;
}
