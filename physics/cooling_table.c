/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reads cooling tables and samples them at a metallicity, joined with the fits for cold gas
 * (doc/manual/cooling.md, sections 1 to 3). */
#include "cooling_table.h"
#include "cooling_advance.h"
#include "mem.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double table_mass = 1e-24;     /* unit of masses in files: g */
static const double no_metals = -5;         /* the [Fe/H] at which tables hold gas without metals */
static const double log_t_end = 10;         /* tables are continued to here */
static const double step = 0.05;            /* in log10 T, between samples of a fit: that of the tables */
static const double coldest = 1;            /* log10 T where the fits begin */
enum { MAX_COLUMNS = 64 };

double cooling_table_feh(double metallicity)
{
    return cooling_feh(metallicity);
}

/* --- reading --- */

/* The numbers of a line; -1 if something else is among them. */
static int read_numbers(const char *text, double *values, int capacity)
{
    int n = 0;
    for (char *end; *(text += strspn(text, " \t\r\n")); text = end) {
        double value = strtod(text, &end);
        if (end == text || !isfinite(value) || n == capacity) return -1;
        values[n++] = value;
    }
    return n;
}

static bool ascending(const double *values, int n)
{
    for (int i = 1; i < n; i++)
        if (!(values[i] > values[i - 1])) return false;
    return true;
}

/* The rows read so far, as they stand in the file. */
struct rows { int n, n_z; double (*row)[1 + 2 * MAX_COLUMNS]; double feh[MAX_COLUMNS], hydrogen[MAX_COLUMNS]; };

static const char *read_line(struct rows *rows, const char *line)
{
    static const char feh[] = "metallicity", hydrogen[] = "hydrogen_mass";
    if (*line == '#' || line[strspn(line, " \t\r\n")] == 0) return NULL;
    if (strncmp(line, feh, strlen(feh)) == 0) {
        rows->n_z = read_numbers(line + strlen(feh), rows->feh, MAX_COLUMNS);
        return rows->n_z > 0 && ascending(rows->feh, rows->n_z) ? NULL : "metallicities must be numbers, ascending";
    }
    if (rows->n_z == 0) return "the first line must name the metallicities";
    if (strncmp(line, hydrogen, strlen(hydrogen)) == 0)
        return read_numbers(line + strlen(hydrogen), rows->hydrogen, MAX_COLUMNS) == rows->n_z
             ? NULL : "expects a mass for each metallicity";
    if (rows->n == COOLING_SAMPLES / 2) return "has too many temperatures";
    rows->row = mem_resize("cooling", rows->row, (size_t)(rows->n + 1) * sizeof *rows->row);
    if (read_numbers(line, rows->row[rows->n], 1 + 2 * MAX_COLUMNS) != 1 + 2 * rows->n_z)
        return "expects log T, then log L and then the mass of a particle for each metallicity";
    rows->n++;
    return NULL;
}

/* Temperature over the mass of a particle, which is what u is, must rise with temperature. */
static const char *find_fault(const struct rows *rows)
{
    if (rows->n < 2) return "has fewer than two temperatures";
    for (int z = 0; z < rows->n_z; z++)
        if (!(rows->hydrogen[z] > 0)) return "has no hydrogen_mass above 0 for each metallicity";
    for (int t = 0; t < rows->n; t++)
        for (int z = 0; z < rows->n_z; z++) {
            const double *now = rows->row[t], *before = rows->row[t ? t - 1 : 0];
            int m = 1 + rows->n_z + z;
            if (!(now[m] > 0)) return "has a mass of a particle that is not above 0";
            if (t > 0 && !(now[0] > before[0] && now[0] - log10(now[m]) > before[0] - log10(before[m])))
                return "does not ascend in temperature and in temperature over mass";
        }
    return NULL;
}

static struct cooling_table *arrange(const struct rows *rows)
{
    struct cooling_table *table = mem_alloc("cooling", sizeof *table);
    int cells = rows->n * rows->n_z;
    double **const column[] = {&table->log_t, &table->feh, &table->hydrogen, &table->log_l, &table->particle};
    const int length[] = {rows->n, rows->n_z, rows->n_z, cells, cells};
    table->n_t = rows->n;
    table->n_z = rows->n_z;
    for (int i = 0; i < 5; i++) *column[i] = mem_array("cooling", double, length[i]);
    for (int z = 0; z < rows->n_z; z++) {
        table->feh[z] = rows->feh[z];
        table->hydrogen[z] = table_mass * rows->hydrogen[z];
        for (int t = 0; t < rows->n; t++) {
            table->log_l[z * rows->n + t] = rows->row[t][1 + z];
            table->particle[z * rows->n + t] = table_mass * rows->row[t][1 + rows->n_z + z];
        }
    }
    for (int t = 0; t < rows->n; t++) table->log_t[t] = rows->row[t][0];
    return table;
}

struct cooling_table *cooling_table_read(const char *path, struct problems *problems)
{
    FILE *file = fopen(path, "r");
    if (!file) {
        problems_add(problems, "%s: cannot be read: %s", path, strerror(errno));
        return NULL;
    }
    struct rows rows = {0};
    struct cooling_table *table = NULL;
    const char *fault = NULL;
    char *line = NULL;
    size_t size = 0;
    int number = 0;
    while (!fault && getline(&line, &size, file) >= 0) {
        fault = read_line(&rows, line);
        number++;
    }
    if (fault) problems_add(problems, "%s:%d: %s", path, number, fault);
    else if ((fault = find_fault(&rows))) problems_add(problems, "%s: %s", path, fault);
    else table = arrange(&rows);
    free(line);
    mem_free(rows.row);
    fclose(file);
    return table;
}

void cooling_table_free(struct cooling_table *table)
{
    if (!table) return;
    double *const columns[] = {table->log_t, table->feh, table->hydrogen, table->log_l, table->particle};
    for (int i = 0; i < 5; i++) mem_free(columns[i]);
    mem_free(table);
}

/* --- samples --- */

/* A place between two columns of metallicity. */
struct blend { int z; double part; };

static struct blend find_metallicity(const struct cooling_table *table, double feh)
{
    int z = 0;
    if (table->n_z == 1 || feh <= table->feh[0]) return (struct blend){0, 0};
    while (z < table->n_z - 2 && feh > table->feh[z + 1]) z++;
    return (struct blend){z, fmin(1, (feh - table->feh[z]) / (table->feh[z + 1] - table->feh[z]))};
}

static double mix(struct blend b, const double *column, int stride)
{
    const double *at = column + b.z * stride;
    return b.part > 0 ? at[0] + b.part * (at[stride] - at[0]) : at[0];
}

static struct cooling_sample table_row(const struct cooling_table *table, struct blend b, int t)
{
    return (struct cooling_sample){pow(10, table->log_t[t]), pow(10, mix(b, table->log_l + t, table->n_t)),
                                   mix(b, table->particle + t, table->n_t), mix(b, table->hydrogen, 1)};
}

/* Between samples everything is a power law. */
static struct cooling_sample between(struct cooling_sample a, struct cooling_sample b, double part)
{
    return (struct cooling_sample){a.t * pow(b.t / a.t, part), a.loss * pow(b.loss / a.loss, part),
                                   a.particle * pow(b.particle / a.particle, part),
                                   a.hydrogen * pow(b.hydrogen / a.hydrogen, part)};
}

static struct cooling_sample sample_at(const struct cooling_samples *samples, double t)
{
    const struct cooling_sample *at = samples->at;
    if (t <= at->t) return *at;
    while (at < samples->at + samples->n - 2 && t > at[1].t) at++;
    return between(at[0], at[1], log(t / at[0].t) / log(at[1].t / at[0].t));
}

static void append(struct cooling_samples *samples, struct cooling_sample sample)
{
    check(samples->n < COOLING_SAMPLES);
    samples->at[samples->n++] = sample;
}

void cooling_table_sample(const struct cooling_table *table, double feh, struct cooling_samples *samples)
{
    struct blend b = find_metallicity(table, feh);
    samples->n = 0;
    for (int t = 0; t < table->n_t; t++) append(samples, table_row(table, b, t));
    const struct cooling_sample last = samples->at[samples->n - 1];
    for (double log_t = table->log_t[table->n_t - 1] + 2 * step; log_t < log_t_end + step; log_t += 2 * step) {
        struct cooling_sample sample = last;
        sample.t = pow(10, log_t);
        sample.loss = last.loss * sqrt(sample.t / last.t);
        append(samples, sample);
    }
}

/* Samples of `upper` above t. */
static void append_above(struct cooling_samples *samples, const struct cooling_samples *upper, double t)
{
    for (int k = 0; k < upper->n; k++)
        if (upper->at[k].t > t * (1 + 1e-9)) append(samples, upper->at[k]);
}

static const double metal_end = 8000;       /* K: hydrogen cools above */

double cooling_table_dalgarno(double t, double metals)
{
    double hydrogen = 2.179e-44 * pow(t, 5), cold = t < 2000 ? 2.238e-32 * t * t : 1.0012e-30 * t * sqrt(t);
    return t < metal_end ? hydrogen + metals * fmax(cold - hydrogen, 0) : hydrogen;
}

/* The first temperature at which the table's loss rises above the fit's; the table's first where it
 * begins above. */
static double find_join(const struct cooling_samples *table, double metals)
{
    for (int k = 0; k < table->n; k++) {
        const struct cooling_sample *now = &table->at[k], *before = &table->at[k ? k - 1 : 0];
        double above = log(now->loss / cooling_table_dalgarno(now->t, metals));
        if (above < 0) continue;
        double below = log(before->loss / cooling_table_dalgarno(before->t, metals));
        return k == 0 ? now->t : before->t * pow(now->t / before->t, below / (below - above));
    }
    fail(STATUS_INPUT, "the cooling table stays below the fit for cold gas at every temperature");
}

void cooling_table_sample_low(const struct cooling_table *table, double feh, struct cooling_samples *samples)
{
    struct cooling_samples upper;
    cooling_table_sample(table, feh, &upper);
    double metals = feh > no_metals ? pow(10, feh) : 0, join = find_join(&upper, metals), log_join = log10(join);
    samples->n = 0;
    for (int k = 0; coldest + k * step < log_join - 1e-9; k++) {
        struct cooling_sample sample = sample_at(&upper, pow(10, coldest + k * step));
        sample.t = pow(10, coldest + k * step);
        sample.loss = cooling_table_dalgarno(sample.t, metals);
        append(samples, sample);
    }
    append(samples, sample_at(&upper, join));
    append_above(samples, &upper, join);
}

double cooling_table_koyama(double t)
{
    return COOLING_KOYAMA_HEATING * (1e7 * exp(-1.184e5 / (t + 1000)) + 1.4e-2 * sqrt(t) * exp(-92 / t));
}

void cooling_table_sample_koyama(const struct cooling_table *table, double feh, struct cooling_samples *samples)
{
    const double nucleus = 1.37 * 1.6733e-24;           /* g: n = rho/(1.37 m_H), of nuclei and for the pressure */
    const double from = 4.1, to = 4.2, fine = step / 2; /* the fit holds to 4.2; it does not meet the table */
    struct cooling_samples upper;
    cooling_table_sample(table, feh, &upper);
    samples->n = 0;
    for (int k = 0; coldest + k * fine < to - 1e-9; k++) {
        double log_t = coldest + k * fine, t = pow(10, log_t);
        struct cooling_sample cold = {t, cooling_table_koyama(t), nucleus, nucleus};
        append(samples, log_t <= from ? cold : between(cold, sample_at(&upper, t), (log_t - from) / (to - from)));
    }
    append_above(samples, &upper, pow(10, to) * (1 - 1e-6));
}
