/* SPDX-License-Identifier: GPL-3.0-or-later
 * The parts of SPH among themselves: parameters and state of the module, batches of active rows and
 * the rows that they meet.
 *
 * A batch is the active rows of one group (a cell of the tree with at most group_size gas rows). The
 * rows within its reach are found once a step, by the search for h, and staged into a tile of floats about
 * its centre, predicted to now; clusters of SPH_LANES rows then run down the part of the tile that is near them.
 *
 * Of sleeping rows, position, velocity and u are predicted; rho and h follow div v (sph_rho_now); the
 * Balsara factor is that of their last own step. h of an active row changes what its sleeping
 * neighbours would find, but they see it only at their own next step. */
#ifndef TEPHRA_SPH_H
#define TEPHRA_SPH_H
#include "engine.h"
#include "lanes.h"
#include "row.h"
#include "search.h"
#include "sim.h"
#include <math.h>

enum { SPH_BATCH = 512 };
enum sph_eos { SPH_ADIABATIC, SPH_ISOTHERMAL, SPH_BAROTROPIC };
enum sph_count { SPH_EXACT, SPH_SMOOTH };
enum sph_equation { SPH_ENERGY, SPH_ENTROPY };
enum sph_viscosity_kind { SPH_MONAGHAN, SPH_SIGNAL };
enum sph_strength { SPH_CONSTANT, SPH_SHOCKS };

/* Rows [first, first + count) of the gas' active list; the rows that they may meet in the arena, or
 * list = -1. stale: a row outside found an h that the list did not allow for. waiting: for
 * rows of other ranks. cluster: number of its first cluster. */
struct sph_batch { int32_t node, first, count, n_list, cluster; int64_t list; bool stale, waiting; };

/* Rows [first, first + n): a list is n_list of these, since rows in reach mostly follow each other. */
struct sph_run { int32_t first, n; };

/* What a cluster meets: n entries of its batch's list, from `at` of sph->met on; n = -1: not kept. */
struct sph_met { int64_t at; int32_t n; };

/* What one thread works with. */
struct sph_work {
    struct sph_tile tile;
    struct sph_meet meet;
    int32_t row[SPH_TILE];          /* of the tile's entries */
    double centre[3], vel[3];       /* of the tile */
    double origin[3];               /* the centre, as the image of the box sees it whose rows are staged */
    float low[3], high[3];          /* the region's box about the centre */
    bool more;                      /* rows beyond the tile's room are in reach too */
    bool missing;                   /* rows of other ranks may be in reach that are not here: asked for */
};

struct sph {
    /* Parameters. */
    int64_t neighbours, group_size, step_ratio;
    int count, eos, preset, kernel, equation, viscosity, strength;
    bool balsara, grad_h;
    double alpha, beta, alpha_min, epsilon, balsara_epsilon, conduction;
    double gamma, mu, sound_speed, stiff_density, h_min, courant, acceleration;
    /* State. */
    const struct sph_loops *loops;
    int levels;                     /* rungs of neighbours differ by at most so many */
    struct sph_meet meet;           /* which pairs meet */
    float excess;                   /* of a row's own density, over m/h^3 */
    struct sph_work **work;
    int n_work;
    int32_t *group, n_groups;
    int64_t grouped;                /* tick of the tree that the groups are of */
    struct sph_batch *batch;
    int32_t n_batches;
    struct sph_run *arena;
    int64_t arena_size, arena_used;
    struct sph_met *cluster;        /* found by DENSITY, serves FORCE too */
    uint16_t *met;
    int64_t met_size, met_used;
    struct sph_engine *engine;      /* on a device; made at the first search */
    struct sph_run *touched;        /* rows of other ranks that an h of this step reaches, larger than their lists allow for */
    int64_t n_touched, touched_room;
    bool unforeseen;                /* an h of this step is larger than any list allows for */
    double taken;                   /* energy that an equation of state without u has taken, of all ranks, since the start */
    int64_t retries;                /* rows whose search for h had to look further, since the start */
};

/* batches.c: groups after a rebuild, batches of this step's active rows, scratch for every thread. */
void sph_make_batches(struct sim *sim, struct sph *sph);
/* Divides n rows of the gas, ascending, into batches without lists; returns their number, sph_most_batches at most. */
int32_t sph_divide(const struct sim *sim, const struct sph *sph, const int32_t *row, int64_t n, struct sph_batch *batch);
int64_t sph_most_batches(const struct sph *sph, int64_t n);
/* After LIMIT nothing asks for batches and lists. They go where rebuilds of the tree, snapshots and pictures need their room;
 * from one small step to the next they stay, since memory that is given back must be mapped anew. */
void sph_drop_lists(struct sph *sph);
void sph_free_batches(struct sph *sph);
/* Keeps the tile's rows as the list of the batch, if the arena has room. */
void sph_keep_list(struct sph *sph, const struct sph_work *work, const struct sim *sim, struct sph_batch *batch);
/* Keeps the n entries that a cluster meets, listed in the tile, if there is room. */
struct sph_met sph_keep_met(struct sph *sph, const struct sph_tile *tile, int n);
/* The first batch that ends at a row or after it (n_batches: none). */
int32_t sph_batch_at(const struct sim *sim, const struct sph *sph, int32_t row);
/* The cell whose gas rows are the group that a row belongs to. */
int32_t sph_group_of(const struct sim *sim, const struct sph *sph, int32_t row);
/* Does the batches' work, and again that of those which had to wait for rows of other ranks. False: it has to wait. */
void sph_for_batches(struct sim *sim, struct sph *sph, bool (*work)(struct sim *, struct sph *, struct sph_batch *));
/* Largest smoothing length in each node: of all nodes after a rebuild, else at least above the rows
 * whose step ends now. */
void sph_fit_h_max(struct sim *sim);

/* tile.c. A region: the rows of a batch, or some of them. */
struct sph_region { const int32_t *row; int n; };
struct sph_region sph_batch_rows(const struct sim *sim, const struct sph_batch *batch);
float sph_largest_h(const struct sim *sim, struct sph_region rows);
/* The region's box becomes the work's. Centre and velocity are those of the cell that its rows are a
 * group of, whatever part of the group the region is: a border between ranks then changes no bit. */
void sph_centre(struct sph_work *work, const struct sim *sim, int32_t node, struct sph_region region);
/* A row as it is now, about the work's centre. */
struct sph_place sph_place_row(const struct sph_work *work, const struct sim *sim, int32_t i);
/* The rungs of some rows' steps. */
struct sph_rungs { const uint8_t *of; int low, high; };
/* Which rows are staged: those within `rows` + max(least, factor times their h) of the region's box.
 * search: h of the rows whose step ends is what is expected of it, and velocities are left out.
 * beyond: unless NULL, only rows whose own rung lies below low or above high. */
struct sph_reach { float rows, least, factor; bool search; const struct sph_rungs *beyond; };
/* Stages the gas rows in reach. The first `skip` of them are passed over. Where other ranks have rows that may be in reach
 * and are not here, they are asked for, and `missing` is set: what is staged is not all. */
void sph_gather(struct sph_work *work, const struct sim *sim, struct sph_reach reach, int64_t skip);
/* All that the kernels of the rows may meet, once every h is known. */
static inline struct sph_reach sph_mutual(const struct sph *sph, float largest_h)
{ return (struct sph_reach){.rows = sph->meet.own * largest_h, .least = sph->meet.least * largest_h, .factor = sph->meet.other}; }
static inline bool sph_is_beyond(const struct sph_rungs *rungs, int32_t row)
{ return rungs->of[row] < rungs->low || rungs->of[row] > rungs->high; }
/* Whether each row of the tile is the image nearest to the centre, so that a list of rows tells them all. */
bool sph_nearest(const struct sph_work *work, const struct sim *sim);
/* Stages the n rows that stand in work->row, in a box their nearest images. */
void sph_stage(struct sph_work *work, const struct sim *sim, int n);
/* The rows of the batch's list, of those beyond these rungs (NULL: all), go to work->row; their number. */
int sph_list_rows(struct sph_work *work, const struct sph *sph, const struct sph_batch *batch, const struct sph_rungs *beyond);
/* After staging, for a region of `rows` rows: blocks of the tile, if they pay. */
static inline void sph_enclose(const struct sph *sph, struct sph_work *work, int rows)
{
    enum { FEW = 4 * SPH_LANES };
    work->tile.blocks = 0;
    if (rows > FEW) sph->loops->enclose(&work->tile);
}
/* Adds what the force needs to the staged rows. */
void sph_stage_state(struct sph_work *work, const struct sim *sim, const struct sph *sph);
/* Up to SPH_LANES rows into lanes; returns their box. */
struct sph_box sph_lanes_fill(struct sph_lanes *lanes, const struct sph_work *work, const struct sim *sim,
                              struct sph_region cluster);
void sph_lanes_state(struct sph_lanes *lanes, const struct sim *sim, const struct sph *sph,
                     struct sph_region cluster);

static inline struct sph_viscosity sph_viscosity_of(const struct sph *sph)
{
    return (struct sph_viscosity){(float)sph->alpha, (float)sph->beta, (float)sph->epsilon, sph->equation == SPH_ENERGY,
                                  (float)(4 * sph->conduction / (sph->gamma * (sph->gamma - 1)))};
}

/* device.c: the hooks on a device, which knows open space alone. False if the CPU must do it instead. */
static inline bool sph_uses_device(const struct sim *sim) { return sim_device(sim) && !box_closed(&sim->box); }
bool sph_device_search(struct sim *sim, struct sph *sph, const struct sph_quest *quest);
bool sph_device_density(struct sim *sim, struct sph *sph);
bool sph_device_force(struct sim *sim, struct sph *sph);

/* A problem of the scene where the module needs gas whose energy is integrated, and sph.eos says otherwise. */
void sph_need_energy(struct sim *sim, const char *module);

/* The hooks. */
void sph_smooth(struct sim *sim, void *state);      /* smooth.c: H */
void sph_density(struct sim *sim, void *state);     /* loops.c: DENSITY */
void sph_force(struct sim *sim, void *state);       /* loops.c: FORCE */
void sph_limit(struct sim *sim, void *state);       /* limit.c: LIMIT */
struct step_reason;
void sph_reason(const struct sim *sim, const void *state, const struct species *gas, int64_t i, struct step_reason *step);

static inline struct sph_law sph_law_of(const struct sph *sph)
{
    return (struct sph_law){sph->eos == SPH_ADIABATIC, sph->eos == SPH_BAROTROPIC, sph->equation == SPH_ENTROPY, sph->grad_h,
                            sph->balsara, sph->strength == SPH_SHOCKS, sph->excess, sph->gamma, sph->sound_speed,
                            sph->stiff_density, sph->h_min, sph->balsara_epsilon, sph->alpha, sph->alpha_min};
}

/* The formulas of row.h for the tables of a simulation. */
static inline float sph_h_now(const struct sim *sim, int64_t i)
{ return sph_row_h(&sim->species[GAS], i, (float)sph_row_lag(&sim->time, &sim->species[GAS], i)); }
static inline float sph_rho_now(const struct sim *sim, int64_t i)
{ return sph_row_rho(&sim->species[GAS], i, (float)sph_row_lag(&sim->time, &sim->species[GAS], i)); }
static inline float sph_h_expected(const struct sim *sim, int64_t i, float t)
{
    const struct species *gas = &sim->species[GAS];
    return sph_row_h_expected(gas, i, t, t > 0 ? 0 : (float)timeline_step(&sim->time, gas->rung0[i]));
}
static inline float sph_stiffening(const struct sph *sph, float rho) { return sph_law_stiffening(sph_law_of(sph), rho); }
/* P/rho of gas with specific internal energy u (ignored without an energy equation) and density rho. */
static inline double sph_heat(const struct sph *sph, double u, double rho)
{
    if (sph->eos == SPH_ADIABATIC) return (sph->gamma - 1) * u;
    return sph->sound_speed * sph->sound_speed * (1 + (double)sph_stiffening(sph, (float)rho));
}
static inline float sph_sound_speed(const struct sph *sph, float u, float rho)
{ return sph_law_sound_speed(sph_law_of(sph), u, rho); }
#endif
