/* SPDX-License-Identifier: GPL-3.0-or-later
 * The rows of budget.csv. */
#include "budget.h"
#include "comm.h"
#include "file/series.h"
#include "module.h"
#include <string.h>

enum { COLUMNS = 128, NAME = 48 };

struct budget { struct energy_sink sink; int n; char name[COLUMNS][NAME]; double value[COLUMNS]; };

static void collect(struct energy_sink *sink, const char *column, double value)
{
    struct budget *budget = (struct budget *)sink;
    check(budget->n < COLUMNS && strlen(column) < NAME);
    strcpy(budget->name[budget->n], column);
    budget->value[budget->n++] = value;
}

static void write_header(FILE *file, const void *context)
{
    const struct budget *budget = context;
    for (int i = 0; i < budget->n; i++) fprintf(file, ",%s", budget->name[i]);
}

static void append(const struct sim *sim, const struct budget *budget, const char *name)
{
    FILE *file = series_open(sim, name, write_header, budget);
    series_time(sim, file);
    for (int i = 0; i < budget->n; i++) fprintf(file, ",%.15g", budget->value[i]);
    fprintf(file, "\n");
    series_close(sim, name, file);
}

void budget_write(struct sim *sim, const char *name)
{
    struct budget budget = {.sink = {collect}};
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->budget) sim->use[u].module->budget(sim, sim->use[u].state, &budget.sink);
    if (budget.n == 0) return;
    comm_sum(budget.value, budget.n);
    if (comm_rank() == 0) append(sim, &budget, name);
}
