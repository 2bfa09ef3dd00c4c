/* SPDX-License-Identifier: GPL-3.0-or-later
 * The sums of Hermite's schemes on a device: the states that have changed go over, sums of the active rows come back. */
#include "device.h"
#include "hermite.h"
#include "mem.h"
#include <string.h>

enum { P_MOST = 3 };    /* of order 8 floats do not do */

bool hermite_on_device(const struct sim *sim, const struct hermite *h)
{
    return sim_device(sim) && h->p <= P_MOST && h->precision != HERMITE_DOUBLE;
}

/* Tick of a row's state. corrected: those of the active rows are of now. */
static int64_t state_tick(const struct sim *sim, const struct species *s, int64_t i, bool corrected)
{
    return corrected && timeline_active(&sim->time, s->rung[i]) ? sim->time.tick : timeline_began(&sim->time, s->rung0[i]);
}

/* Places among rows of those whose states are of `since` or later, all where it is negative. */
static int32_t *changed_rows(const struct sim *sim, const struct hermite *h, int64_t since, bool corrected, int64_t *n)
{
    int32_t *place = mem_array("hermite", int32_t, h->rows.n);
    *n = 0;
    for_species(sim, s)
        for (int64_t i = 0; i < s->n; i++) {
            place[*n] = (int32_t)(h->base[s->kind] + i);
            *n += since < 0 || state_tick(sim, s, i, corrected) >= since;
        }
    return place;
}

static void send_rows(const struct sim *sim, const struct hermite *h, const int32_t *place, int64_t n, bool corrected)
{
    const int width = hermite_engine_width(h->engine), kept = hermite_kept(h->p);
    double *state = mem_array("hermite", double, (int64_t)width * n);
    int64_t *began = mem_array("hermite", int64_t, n);
#pragma omp parallel for
    for (int64_t b = 0; b < n; b++)
        for_species(sim, s) {
            const int64_t i = place[b] - h->base[s->kind];
            if (i < 0 || i >= s->n) continue;
            began[b] = state_tick(sim, s, i, corrected);
            for (int k = 0; k < 3; k++) {
                state[k * n + b] = s->pos[i][k];
                state[(3 + k) * n + b] = s->vel[i][k];
                for (int d = 0; d < kept; d++)
                    state[(6 + 3 * d + k) * n + b] = ((const double *)species_column(s, hermite_column[d]))[3 * i + k];
            }
            state[(width - 2) * n + b] = h->gravity->G * s->mass[i];
            state[(width - 1) * n + b] = gravity_half_soft2(h->gravity, s, i);
        }
    hermite_engine_put(h->engine, &(struct hermite_states){n, place, state, began});
    mem_free(began);
    mem_free(state);
}

bool hermite_evaluate_device(struct sim *sim, struct hermite *h, int derivatives, bool corrected)
{
    const bool fresh = !h->engine || h->built != sim->tree.built;   /* a new tree has put the rows in another order */
    int64_t n;
    if (!h->engine) h->engine = hermite_engine_create(sim->device, h->p, h->gravity->form != SOFT_COMMON, 0);
    if (fresh) hermite_engine_rows(h->engine, h->rows.n, &h->units);
    int32_t *place = changed_rows(sim, h, fresh ? -1 : h->sent, corrected, &n);
    send_rows(sim, h, place, n, corrected);
    mem_free(place);
    h->built = sim->tree.built;
    h->sent = sim->time.tick;
    double *sum = mem_array("hermite", double, h->n * 3 * derivatives);
    const struct hermite_now now = {sim->time.tick, timeline_seconds(&sim->time, 1)};
    hermite_engine_sum(h->engine, &now, derivatives, h->target, h->n, sum);
    const char *error = device_error(sim->device);
    for (int64_t t = 0; t < h->n && !error; t++)
        memcpy(h->sum[t], sum + t * 3 * derivatives, (size_t)(3 * derivatives) * sizeof(double));
    mem_free(sum);
    return !error || !sim_leave_device(sim, "hermite", error);
}
