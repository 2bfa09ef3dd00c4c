/* SPDX-License-Identifier: GPL-3.0-or-later
 * Solver direct on a device: all rows, predicted to now, go over as sources; accelerations and
 * potentials of the active rows come back. */
#include "device.h"
#include "direct_engine.h"
#include "gravity.h"
#include "mem.h"
#include <math.h>

/* Rows of all species, one after another. */
struct gathered { int64_t n; double (*pos)[3], *mass; float *soft; int32_t *own; };

static struct gathered gathered_make(int64_t n)
{
    return (struct gathered){0, mem_alloc("gravity", (size_t)n * sizeof(double[3])), mem_array("gravity", double, n),
                             mem_array("gravity", float, n), mem_array("gravity", int32_t, n)};
}

static void gathered_free(struct gathered *rows)
{
    mem_free(rows->pos);
    mem_free(rows->mass);
    mem_free(rows->soft);
    mem_free(rows->own);
}

/* Rows of a species: the active ones, or all. `first` is the place of row 0 among the sources. */
static void gather(struct gathered *rows, const struct sim *sim, const struct gravity *g, const struct species *s,
                   bool active, int64_t first)
{
    int64_t n = active ? s->n_active : s->n;
#pragma omp parallel for schedule(static)
    for (int64_t a = 0; a < n; a++) {
        int64_t i = active ? s->active[a] : a, to = rows->n + a;
        sim_predict(&sim->time, s, i, rows->pos[to]);
        rows->mass[to] = s->mass[i];
        rows->soft[to] = (float)gravity_half_soft2(g, s, i);
        rows->own[to] = (int32_t)(first + i);
    }
    rows->n += n;
}

static void deliver(struct sim *sim, const struct gravity *g, enum gravity_output output, double (*acc)[3],
                    const double *pot)
{
    bool wanted = output == OUTPUT_POTENTIAL || (output == OUTPUT_FORCE && sim->want_potential);
    int64_t from = 0;
    for_species(sim, s) {
        for (int64_t a = 0; a < s->n_active; a++, from++) {
            int64_t i = s->active[a];
            double size2 = 0;
            for (int k = 0; k < 3; k++) {
                size2 += acc[from][k] * acc[from][k];
                if (output == OUTPUT_FORCE) s->acc[i][k] += (float)(g->G * acc[from][k]);
            }
            if (s->grav && output != OUTPUT_POTENTIAL) s->grav[i] = (float)(g->G * sqrt(size2));
            if (wanted) s->pot[i] = (float)(g->G * pot[from]);
        }
    }
}

bool gravity_direct_device(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    int64_t n = 0, active = 0, first = 0;
    for_species(sim, s) {
        n += s->n;
        active += s->n_active;
    }
    struct gathered sources = gathered_make(n), targets = gathered_make(active);
    for_species(sim, s) {
        gather(&sources, sim, g, s, false, first);
        gather(&targets, sim, g, s, true, first);
        first += s->n;
    }
    double (*acc)[3] = mem_alloc("gravity", (size_t)active * sizeof *acc), *pot = mem_array("gravity", double, active);
    if (!g->engine) g->engine = direct_engine_create(sim->device, (int)g->form, DIRECT_PAIR, 0);
    direct_engine_sources(g->engine, &(struct direct_rows){n, sources.pos, sources.mass, sources.soft, NULL});
    direct_engine_sum(g->engine, &(struct direct_rows){active, targets.pos, targets.mass, targets.soft, targets.own},
                      acc, pot);
    const char *error = device_error(sim->device);
    if (!error) deliver(sim, g, output, acc, pot);
    g->pairs = n * active;
    g->cells = 0;
    mem_free(acc);
    mem_free(pot);
    gathered_free(&sources);
    gathered_free(&targets);
    return !error || !sim_leave_device(sim, "gravity", error);
}
