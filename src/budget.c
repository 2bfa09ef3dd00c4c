/* SPDX-License-Identifier: GPL-3.0-or-later
 * The rows of budget.csv. */
#include "budget.h"
#include "comm.h"
#include "layout.h"
#include "module.h"
#include <errno.h>
#include <stdio.h>
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

static void append(const struct sim *sim, const struct budget *budget, const char *path)
{
    FILE *file = fopen(path, "a");
    if (!file) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
    fseek(file, 0, SEEK_END);
    if (ftell(file) == 0) {
        char unit[64];
        layout_unit_text(sim->units.physical, "L V^-1", unit, sizeof unit);
        fprintf(file, "t [%s]", unit);
        for (int i = 0; i < budget->n; i++) fprintf(file, ",%s", budget->name[i]);
        fprintf(file, "\n");
    }
    fprintf(file, "%.10g", layout_factor(&sim->units, "L V^-1") * timeline_now(&sim->time));
    for (int i = 0; i < budget->n; i++) fprintf(file, ",%.15g", budget->value[i]);
    fprintf(file, "\n");
    if (fclose(file) != 0) fail(STATUS_ENVIRONMENT, "%s: cannot be written: %s", path, strerror(errno));
}

void budget_write(struct sim *sim, const char *path)
{
    struct budget budget = {.sink = {collect}};
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->budget) sim->use[u].module->budget(sim, sim->use[u].state, &budget.sink);
    if (budget.n == 0) return;
    comm_sum(budget.value, budget.n);
    if (comm_rank() == 0) append(sim, &budget, path);
}
