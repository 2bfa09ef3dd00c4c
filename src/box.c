/* SPDX-License-Identifier: GPL-3.0-or-later
 * The block `box` (box.h). */
#include "box.h"
#include "module.h"

#define SIDE(axis, k) {axis, PARAM_REAL, "length", "none", 1e-300, 1e300, NULL, \
    "side along " axis ", where space closes on itself; open without", false, offsetof(struct box, side) + k * sizeof(double)}

const struct param box_params[] = {SIDE("x", 0), SIDE("y", 1), SIDE("z", 2), {0}};

static void adopt(struct sim *sim, const struct box *box)
{
    for (int k = 0; k < 3; k++) sim->box.side[k] = box->side[k] > 0 ? box->side[k] : 0;
}

void box_read(struct sim *sim) { adopt(sim, sim_state(sim, "box")); }

bool box_awaits_file(const struct sim *sim)
{
    return sim_state(sim, "box") && !box_closed(&sim->box);
}

void box_from_file(struct sim *sim, const double side[3])
{
    struct box *box = sim_state(sim, "box");
    for (int k = 0; k < 3; k++)
        if (side[k] > 0) box->side[k] = side[k];
    adopt(sim, box);
}

static void declare(struct sim *sim, void *state)
{
    adopt(sim, state);
    if (!box_closed(&sim->box) && !scene_value(sim->scene, "start", "file"))
        problems_add(&sim->problems, "box: give at least one of the sides x, y and z");
    for (int u = 0; u < sim->n_use; u++)
        if (sim->use[u].module->open_space)
            problems_add(&sim->problems, "block \"%s\" knows open space only: it cannot be used with a box",
                         sim->use[u].module->name);
}

static void begin(struct sim *sim, void *state)
{
    (void)state;
    if (!box_closed(&sim->box)) fail(STATUS_INPUT, "box: has no sides, and the file no BoxSize");
}

void box_wrap(const struct box *box, double pos[3])
{
    for (int k = 0; k < 3; k++) {
        double side = box->side[k];
        if (!(side > 0) || (pos[k] >= 0 && pos[k] < side)) continue;
        pos[k] -= side * floor(pos[k] / side);
        if (pos[k] >= side) pos[k] = 0;     /* a tiny negative number, rounded */
    }
}

/* A sleeping row is shifted by what its predicted position needs. */
void box_wrap_rows(struct sim *sim)
{
    if (!box_closed(&sim->box)) return;
    for_species(sim, s) {
#pragma omp parallel for
        for (int64_t i = species_from(s); i < species_to(s); i++) {
            double now[3], wrapped[3];
            sim_predict(&sim->time, s, i, now);
            for (int k = 0; k < 3; k++) wrapped[k] = now[k];
            box_wrap(&sim->box, wrapped);
            bool active = timeline_active(&sim->time, s->rung[i]);
            for (int k = 0; k < 3; k++)
                if (wrapped[k] != now[k]) s->pos[i][k] = active ? wrapped[k] : s->pos[i][k] + (wrapped[k] - now[k]);
        }
    }
}

struct box_images box_images(const struct box *box, const double own[2][3], const double other[2][3])
{
    struct box_images images = {{0}, {0}};
    for (int k = 0; k < 3; k++) {
        if (!(box->side[k] > 0)) continue;
        images.first[k] = (int)ceil((other[0][k] - own[1][k]) / box->side[k]);
        images.last[k] = (int)floor((other[1][k] - own[0][k]) / box->side[k]);
    }
    return images;
}

const struct module box_module = {
    .name = "box", .doc = "a box whose sides close on themselves", .kind = MODULE_BLOCK,
    .params = box_params, .state_bytes = sizeof(struct box), .declare = declare, .begin = begin,
};
