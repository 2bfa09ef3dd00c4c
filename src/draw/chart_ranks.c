/* SPDX-License-Identifier: GPL-3.0-or-later
 * `tephra chart ranks`: what finished runs cost on different numbers of ranks, from the ranks.csv of their directories:
 * T_total = T_construction + T_calculation + T_communication of the busiest rank, its efficiency T_1/(N_p T_Np), the bytes
 * that ranks send and hold, and laws fitted to them (doc/manual/ranks.md). */
#include "chart.h"
#include "fail.h"
#include "mem.h"
#include "profile.h"
#include <errno.h>
#include <gsl/gsl_multifit.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct chart_ranks { char *runs; };

static const struct param params[] = {
    {"runs", PARAM_TEXT, "", NULL, 0, 0, NULL, "directories of runs of one scene, a blank between", true,
     offsetof(struct chart_ranks, runs)},
    {0}
};

/* One run: its busiest rank by T_total, and the largest figures of any of its ranks but the first, which gathers the files. */
struct run {
    char *name;
    int ranks;
    double rows, updates, total, bytes, memory, ghost_rows, ghost_cells;
    struct rank_cost busiest;
};

static double cpu_of(const struct rank_cost *c) { return c->construction + c->calculation; }
static double total_of(const struct rank_cost *c) { return cpu_of(c) + c->communication; }

static struct run read_run(const char *name)
{
    struct run run = {.name = mem_text("charts", name), .total = -1};
    char *path = mem_format("charts", "%s/ranks.csv", name);
    struct rank_cost *cost = profile_read_ranks(path, &run.ranks);
    if (!cost)
        fail(STATUS_INPUT, "%s: %s; chart.runs names directories of finished runs", path,
             errno ? strerror(errno) : "is no ranks.csv of this program");
    for (int r = 0; r < run.ranks; r++) {
        const struct rank_cost *c = &cost[r];
        run.rows += c->rows;
        run.updates += c->updates;
        if (total_of(c) > run.total) {
            run.total = total_of(c);
            run.busiest = *c;
        }
        if (r == 0 && run.ranks > 1) continue;
        run.bytes = fmax(run.bytes, c->bytes);
        run.memory = fmax(run.memory, c->memory);
        run.ghost_rows = fmax(run.ghost_rows, c->ghost_rows);
        run.ghost_cells = fmax(run.ghost_cells, c->ghost_cells);
    }
    mem_free(cost);
    mem_free(path);
    return run;
}

static bool is_near(double a, double b) { return fabs(a - b) <= 0.01 * fabs(b); }

/* The run on one rank of so many rows that did as many updates a row (ranks.csv of a run that was continued holds its last part
 * alone); NULL if there is none. */
static const struct run *alone(const struct run *all, int n, double rows, const struct run *like)
{
    for (int k = 0; k < n; k++)
        if (all[k].ranks == 1 && is_near(all[k].rows, rows) && is_near(all[k].updates / all[k].rows, like->updates / like->rows))
            return &all[k];
    return NULL;
}

/* A law value = A rows^B ranks^C of the runs on several ranks, by least squares of the logarithms, as a line of the head. */
static void fit(struct chart_sheet *sheet, const char *what, const struct run *all, int n, size_t field)
{
    enum { TERMS = 3 };
    gsl_matrix *x = gsl_matrix_alloc((size_t)n, TERMS), *covariance = gsl_matrix_alloc(TERMS, TERMS);
    gsl_vector *y = gsl_vector_alloc((size_t)n), *c = gsl_vector_alloc(TERMS);
    double least[2] = {INFINITY, INFINITY}, most[2] = {0}, chi2;
    size_t used = 0;
    for (int k = 0; k < n; k++) {
        const double at[2] = {all[k].rows, all[k].ranks};
        double value;
        memcpy(&value, (const char *)&all[k] + field, sizeof value);
        if (all[k].ranks == 1 || !(value > 0)) continue;
        for (int j = 0; j < 2; j++) {
            least[j] = fmin(least[j], at[j]);
            most[j] = fmax(most[j], at[j]);
            gsl_matrix_set(x, used, (size_t)j + 1, log(at[j]));
        }
        gsl_matrix_set(x, used, 0, 1);
        gsl_vector_set(y, used++, log(value));
    }
    if (used > TERMS) {
        const double enough = 1e-3;     /* singular values below this part of the largest: runs that vary one thing alone */
        size_t rank;
        gsl_multifit_linear_workspace *work = gsl_multifit_linear_alloc(used, TERMS);
        gsl_matrix_view rows = gsl_matrix_submatrix(x, 0, 0, used, TERMS);
        gsl_vector_view values = gsl_vector_subvector(y, 0, used);
        gsl_multifit_linear_tsvd(&rows.matrix, &values.vector, enough, c, covariance, &chi2, &rank, work);
        if (rank == TERMS)
            chart_note(sheet, "law: %s = %.4g rows^%.3f ranks^%.3f, rms deviation %.0f %%, "
                       "%zu runs of %.3g to %.3g rows on %.0f to %.0f ranks", what, exp(gsl_vector_get(c, 0)),
                       gsl_vector_get(c, 1), gsl_vector_get(c, 2), 100 * sqrt(chi2 / (double)used), used, least[0], most[0],
                       least[1], most[1]);
        gsl_multifit_linear_free(work);
    }
    gsl_vector_free(c);
    gsl_vector_free(y);
    gsl_matrix_free(covariance);
    gsl_matrix_free(x);
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_ranks *chart = state;
    chart_columns(sheet, "run,rows,ranks,rows_per_rank,construction [s],calculation [s],communication [s],wait [s],total [s],"
                  "efficiency,weak_efficiency,cpu_efficiency,bytes_sent,ghost_rows,ghost_cells,memory [bytes]");
    chart_note(sheet, "times: the busiest rank's; CPU seconds but for communication and wait, by the clock");
    chart_note(sheet, "efficiency: T_1/(N_p T_Np) of total; weak: T_1/T_Np with as many rows a rank; cpu: of construction and "
               "calculation alone, where ranks share processors");
    chart_note(sheet, "bytes_sent, ghosts, memory: the largest of the ranks but the first, which gathers files");
    struct run *all = NULL;
    int n = 0;
    char *buffer = mem_text("charts", chart->runs);
    for (char *next = buffer, *word; (word = strsep(&next, " "));) {
        if (!*word) continue;
        all = mem_resize("charts", all, (size_t)(n + 1) * sizeof *all);
        all[n++] = read_run(word);
    }
    mem_free(buffer);
    if (n == 0) fail(STATUS_INPUT, "chart.runs names no run: give the directories of finished runs");
    for (int k = 0; k < n; k++) {
        const struct run *r = &all[k], *strong = alone(all, n, r->rows, r), *weak = alone(all, n, r->rows / r->ranks, r);
        const struct rank_cost *c = &r->busiest;
        chart_row(sheet, "%s,%.0f,%d,%.3g,%.4f,%.4f,%.4f,%.4f,%.4f,%.3f,%.3f,%.3f,%.0f,%.0f,%.0f,%.0f", r->name, r->rows, r->ranks,
                  r->rows / r->ranks, c->construction, c->calculation, c->communication, c->wait, r->total,
                  strong ? strong->total / (r->ranks * r->total) : NAN, weak ? weak->total / r->total : NAN,
                  strong ? cpu_of(&strong->busiest) / (r->ranks * cpu_of(c)) : NAN, r->bytes, r->ghost_rows, r->ghost_cells,
                  r->memory);
    }
    fit(sheet, "bytes sent by a rank", all, n, offsetof(struct run, bytes));
    fit(sheet, "rows of others that a rank took in", all, n, offsetof(struct run, ghost_rows));
    fit(sheet, "cells of others that a rank took in", all, n, offsetof(struct run, ghost_cells));
    for (int k = 0; k < n; k++) mem_free(all[k].name);
    mem_free(all);
    chart_panel(sheet, &(struct chart_panel){.title = "strong: T_total of the same rows", .x = "ranks", .y = "total",
                                             .series = "rows", .lines = true});
    chart_panel(sheet, &(struct chart_panel){.title = "weak: T_total of as many rows a rank", .x = "ranks", .y = "total",
                                             .series = "rows_per_rank", .lines = true});
    chart_panel(sheet, &(struct chart_panel){.title = "efficiency T_1/(N_p T_Np)", .x = "ranks", .y = "efficiency",
                                             .series = "rows", .lines = true, .linear_y = true});
    chart_panel(sheet, &(struct chart_panel){.title = "the same of construction and calculation", .x = "ranks",
                                             .y = "cpu_efficiency", .series = "rows", .lines = true, .linear_y = true});
    chart_panel(sheet, &(struct chart_panel){.title = "memory of a rank", .x = "ranks", .y = "memory",
                                             .series = "rows", .lines = true});
    chart_panel(sheet, &(struct chart_panel){.title = "bytes sent by a rank", .x = "ranks", .y = "bytes_sent",
                                             .series = "rows", .lines = true});
}

const struct chart ranks_chart = {"ranks", "time, efficiency, bytes and memory of finished runs against the number of ranks",
                                  params, sizeof(struct chart_ranks), make};
