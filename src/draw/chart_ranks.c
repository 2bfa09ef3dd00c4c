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

struct chart_ranks { char *runs; double rows; int64_t ranks; double latency, bandwidth; };

static const struct param params[] = {
    {"runs", PARAM_TEXT, "", NULL, 0, 0, NULL, "directories of runs of one scene, a blank between", true,
     offsetof(struct chart_ranks, runs)},
    {"project_rows", PARAM_REAL, "", "none", 1, 1e15, NULL, "rows for which the laws of the runs are projected; default: none", true,
     offsetof(struct chart_ranks, rows)},
    {"project_ranks", PARAM_COUNT, "", "10000", 2, 100000000, NULL, "... on so many ranks at most", true,
     offsetof(struct chart_ranks, ranks)},
    {"latency", PARAM_REAL, "", "2e-6", 0, 1, NULL, "seconds that a message takes on the network of the projection", true,
     offsetof(struct chart_ranks, latency)},
    {"bandwidth", PARAM_REAL, "", "12.5e9", 1, 1e15, NULL, "bytes a second that a rank can send there", true,
     offsetof(struct chart_ranks, bandwidth)},
    {0}
};

/* One run: its busiest rank by T_total, and the largest figures of any of its ranks. */
struct run {
    char *name;
    int ranks;
    double rows, updates, total, bytes, memory, ghost_rows, ghost_cells, ghosts, ghost_bytes, top_bytes, rounds, cpu;
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
        run.cpu = fmax(run.cpu, cpu_of(c));
        run.ghosts = fmax(run.ghosts, c->ghost_rows + c->ghost_cells);
        run.ghost_bytes = fmax(run.ghost_bytes, c->ghost_bytes);
        run.top_bytes = fmax(run.top_bytes, c->top_bytes);
        run.rounds = fmax(run.rounds, c->rounds);
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

/* value = factor rows^of_rows ranks^of_ranks, of runs of so many rows and ranks; factor NAN: not to be had. */
struct law { double factor, of_rows, of_ranks, deviation, least[2], most[2]; size_t runs; };

static double law_at(const struct law *law, double rows, double ranks)
{
    return law->factor * pow(rows, law->of_rows) * pow(ranks, law->of_ranks);
}

/* Of the runs on `fewest` ranks or more, by least squares of the logarithms. */
static struct law fit(const struct run *all, int n, int fewest, size_t field)
{
    enum { TERMS = 3 };
    struct law law = {.factor = NAN, .least = {INFINITY, INFINITY}};
    gsl_matrix *x = gsl_matrix_alloc((size_t)n, TERMS), *covariance = gsl_matrix_alloc(TERMS, TERMS);
    gsl_vector *y = gsl_vector_alloc((size_t)n), *c = gsl_vector_alloc(TERMS);
    double chi2;
    for (int k = 0; k < n; k++) {
        const double at[2] = {all[k].rows, all[k].ranks};
        double value;
        memcpy(&value, (const char *)&all[k] + field, sizeof value);
        if (all[k].ranks < fewest || !(value > 0)) continue;
        for (int j = 0; j < 2; j++) {
            law.least[j] = fmin(law.least[j], at[j]);
            law.most[j] = fmax(law.most[j], at[j]);
            gsl_matrix_set(x, law.runs, (size_t)j + 1, log(at[j]));
        }
        gsl_matrix_set(x, law.runs, 0, 1);
        gsl_vector_set(y, law.runs++, log(value));
    }
    if (law.runs > TERMS) {
        const double enough = 1e-3;     /* singular values below this part of the largest: runs that vary one thing alone */
        size_t rank;
        gsl_multifit_linear_workspace *work = gsl_multifit_linear_alloc(law.runs, TERMS);
        gsl_matrix_view rows = gsl_matrix_submatrix(x, 0, 0, law.runs, TERMS);
        gsl_vector_view values = gsl_vector_subvector(y, 0, law.runs);
        gsl_multifit_linear_tsvd(&rows.matrix, &values.vector, enough, c, covariance, &chi2, &rank, work);
        law.factor = rank == TERMS ? exp(gsl_vector_get(c, 0)) : NAN;
        law.of_rows = gsl_vector_get(c, 1);
        law.of_ranks = gsl_vector_get(c, 2);
        law.deviation = sqrt(chi2 / (double)law.runs);
        gsl_multifit_linear_free(work);
    }
    gsl_vector_free(c);
    gsl_vector_free(y);
    gsl_matrix_free(covariance);
    gsl_matrix_free(x);
    return law;
}

static void tell_law(struct chart_sheet *sheet, const char *what, struct law law)
{
    if (isnan(law.factor)) return;
    chart_note(sheet, "law: %s = %.4g rows^%.3f ranks^%.3f, rms deviation %.0f %%, %zu runs of %.3g to %.3g rows on %.0f to %.0f "
               "ranks", what, law.factor, law.of_rows, law.of_ranks, 100 * law.deviation, law.runs, law.least[0], law.most[0],
               law.least[1], law.most[1]);
}

/* Below this each rank still borders on most others, and the laws are of other exponents. */
enum { MANY_RANKS = 4 };

/* CPU seconds a row of the largest run alone, and a row or cell of others of the runs on many ranks: the least square of what
 * these took beyond their own rows. */
static bool find_costs(const struct run *all, int n, double *own, double *other)
{
    double most = 0, sums[2] = {0};
    for (int k = 0; k < n; k++) {
        if (all[k].ranks != 1 || all[k].rows < most) continue;
        most = all[k].rows;
        *own = all[k].cpu / most;
    }
    for (int k = 0; k < n; k++) {
        if (all[k].ranks < MANY_RANKS) continue;
        sums[0] += all[k].ghosts * (all[k].cpu - *own * all[k].rows / all[k].ranks);
        sums[1] += all[k].ghosts * all[k].ghosts;
    }
    *other = sums[0] / sums[1];
    return most > 0 && sums[1] > 0;
}

/* As many updates a row as in the runs; T = c n + w G + B/bandwidth + messages latency. */
static void project(struct chart_sheet *sheet, const struct chart_ranks *chart, const struct run *all, int n)
{
    const struct law ghosts = fit(all, n, MANY_RANKS, offsetof(struct run, ghosts)),
                     bytes = fit(all, n, MANY_RANKS, offsetof(struct run, ghost_bytes)),
                     tops = fit(all, n, MANY_RANKS, offsetof(struct run, top_bytes)),
                     rounds = fit(all, n, MANY_RANKS, offsetof(struct run, rounds));
    double own = 0, other = 0;
    const bool known = find_costs(all, n, &own, &other);
    if (!known || isnan(ghosts.factor + bytes.factor + tops.factor + rounds.factor))
        fail(STATUS_INPUT, "chart.project_rows: needs a run on one rank, and runs of several numbers of rows and of ranks, from %d "
             "ranks on", MANY_RANKS);
    tell_law(sheet, "rows and cells of others", ghosts);
    tell_law(sheet, "bytes sent for them", bytes);
    tell_law(sheet, "bytes sent for topmost cells", tops);
    tell_law(sheet, "rounds of asking", rounds);
    chart_note(sheet, "projected: %.3g s of CPU a row, %.3g s a row or cell of others; %g s a message, %g bytes a second a rank; "
               "a round of asking is three collective calls of 2 log2(ranks) messages each; files are not counted", own, other,
               chart->latency, chart->bandwidth);
    for (double ranks = 16; ranks < 2 * (double)chart->ranks; ranks *= 2) {
        const double r = fmin(ranks, (double)chart->ranks), mine = chart->rows / r, g = law_at(&ghosts, chart->rows, r);
        const double sent = law_at(&bytes, chart->rows, r), top = law_at(&tops, chart->rows, r);
        const double talk = (sent + top) / chart->bandwidth, wait = law_at(&rounds, chart->rows, r) * 6 * log2(r) * chart->latency;
        const double work = own * mine + other * g, total = work + talk + wait, ideal = own * mine;
        chart_cited(sheet, "projection", "projected,%.0f,%.0f,%.3g,,%.4f,,%.4f,%.4f,%.4f,%.3f,,%.3f,%.0f,%.0f,,", chart->rows, r,
                    mine, work, talk, wait, total, ideal / total, ideal / work, sent + top, g);
    }
}

static void make(struct chart_sheet *sheet, const void *state)
{
    const struct chart_ranks *chart = state;
    chart_columns(sheet, "run,rows,ranks,rows_per_rank,construction [s],calculation [s],record [s],communication [s],wait [s],"
                  "total [s],efficiency,weak_efficiency,cpu_efficiency,bytes_sent,ghost_rows,ghost_cells,memory [bytes]");
    chart_note(sheet, "times: the busiest rank's; CPU seconds but for communication and wait, by the clock; total: without "
               "record, which is energies and files");
    chart_note(sheet, "efficiency: T_1/(N_p T_Np) of total; weak: T_1/T_Np with as many rows a rank; cpu: of construction and "
               "calculation alone, where ranks share processors");
    chart_note(sheet, "bytes_sent, ghosts, memory: the largest of the ranks");
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
        chart_row(sheet, "%s,%.0f,%d,%.3g,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.3f,%.3f,%.3f,%.0f,%.0f,%.0f,%.0f", r->name, r->rows,
                  r->ranks, r->rows / r->ranks, c->construction, c->calculation, c->record, c->communication, c->wait, r->total,
                  strong ? strong->total / (r->ranks * r->total) : NAN, weak ? weak->total / r->total : NAN,
                  strong ? cpu_of(&strong->busiest) / (r->ranks * cpu_of(c)) : NAN, r->bytes, r->ghost_rows, r->ghost_cells,
                  r->memory);
    }
    tell_law(sheet, "bytes sent by a rank", fit(all, n, 2, offsetof(struct run, bytes)));
    tell_law(sheet, "rows of others that a rank took in", fit(all, n, 2, offsetof(struct run, ghost_rows)));
    tell_law(sheet, "cells of others that a rank took in", fit(all, n, 2, offsetof(struct run, ghost_cells)));
    if (chart->rows > 0) project(sheet, chart, all, n);
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
