/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart`: runs a chart and writes its CSV file and its picture. Keys are those of the chart, as
 * a scene would write them. */
#include "cmd.h"
#include "comm.h"
#include "draw/chart_sheet.h"
#include "file/text_file.h"
#include "mem.h"
#include "module.h"
#include <errno.h>
#include <string.h>
#include <unistd.h>

static const char usage[] = "chart [NAME [FILE.csv] [key=value]... [--force] [--threads N] [--isa v2|v3|v4]]";

static void list_charts(void)
{
    printf("usage: tephra %s\n\n", usage);
    for (const struct chart *const *c = chart_list; *c; c++) printf("  %-10s %s\n", (*c)->name, (*c)->doc);
    printf("\ntephra params chart.NAME tells the keys of one\n");
}

static const struct chart *find_chart(const char *name)
{
    const char *names[64];
    int count = 0;
    for (const struct chart *const *c = chart_list; *c && count < 64; c++) {
        if (strcmp((*c)->name, name) == 0) return *c;
        names[count++] = (*c)->name;
    }
    const char *near = fail_nearest(name, names, count);
    fail(STATUS_INPUT, "there is no chart \"%s\"%s%s%s; `tephra chart` lists them", name, near ? " (did you mean \"" : "",
         near ? near : "", near ? "\"?)" : "");
}

/* The arguments behind the name: at most one file, and keys. */
static const char *read_arguments(struct chart_sheet *sheet, const struct cmd_options *options)
{
    struct problems problems = {0};
    struct param_target targets[3];
    struct scene *scene = scene_new(".");
    const struct units plain = {.length = 1, .mass = 1, .velocity = 1, .G = 1};
    const char *file = NULL;
    scene_set(scene, "chart={}", &problems);
    for (int i = 1; i < options->n_arguments; i++) {
        const char *argument = options->argument[i];
        if (!strchr(argument, '=') && file) {
            problems_add(&problems, "%s: a second file; usage: tephra %s", argument, usage);
        } else if (!strchr(argument, '=')) {
            file = argument;
        } else {
            char *assignment = mem_format("charts", "chart.%s", argument);
            scene_set(scene, assignment, &problems);
            mem_free(assignment);
        }
    }
    chart_targets(sheet->chart, &sheet->common, sheet->state, targets);
    param_read(scene, "chart", targets, &plain, &problems);
    problems_report(&problems);
    scene_free(scene);
    return file;
}

/* NAME.png beside NAME.csv. */
static char *picture_path(const char *file)
{
    size_t length = strlen(file);
    if (length > 4 && strcmp(file + length - 4, ".png") == 0)
        fail(STATUS_INPUT, "%s: name the CSV file; the picture lies beside it as .png", file);
    if (length > 4 && strcmp(file + length - 4, ".csv") == 0) length -= 4;
    return mem_format("charts", "%.*s.png", (int)length, file);
}

static void refuse_existing(const char *path)
{
    if (access(path, F_OK) == 0) fail(STATUS_INPUT, "%s: exists already (--force overwrites it)", path);
}

static int chart_run_command(int argc, char **argv)
{
    struct cmd_options options;
    if (!cmd_parse(&options, argc, argv, "force threads isa", usage)) return STATUS_DONE;
    if (comm_size() > 1) fail(STATUS_INPUT, "tephra chart measures one rank: run it without mpirun");
    if (options.n_arguments == 0) {
        list_charts();
        return STATUS_DONE;
    }
    cmd_set_threads(&options);
    const struct chart *chart = find_chart(options.argument[0]);
    struct chart_sheet *sheet = chart_sheet_new(chart);
    const char *given = read_arguments(sheet, &options);
    char *file = given ? mem_text("charts", given) : mem_format("charts", "%s.csv", chart->name);
    char *picture = picture_path(file);
    if (!options.force) {
        refuse_existing(file);
        refuse_existing(picture);
    }
    /* Before the work, which may take hours, and may find a mistake. */
    if (!text_file_try(file)) fail(STATUS_INPUT, "%s: cannot be written: %s", file, strerror(errno));
    chart->make(sheet, sheet->state);
    struct text_file text = text_file_open(file);
    if (text.stream) chart_sheet_write(sheet, text.stream);
    if (!text_file_close(&text))
        fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", file, strerror(errno));
    chart_sheet_draw(sheet, picture);
    printf("%s\n%s\n", file, picture);
    chart_sheet_free(sheet);
    mem_free(file);
    mem_free(picture);
    return STATUS_DONE;
}

const struct command chart_command = {"chart", usage, "accuracy against speed, as CSV and picture", chart_run_command};
