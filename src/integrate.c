/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integrators as modules. leapfrog: kick-drift-kick. pec: predictor, one evaluation, corrector,
 * the evaluation serving as the next start value (Heun's scheme with one force a step). */
#include "integrate.h"
#include "log.h"
#include "module.h"
#include <math.h>

/* Rows below which a loop is not worth waking threads for. */
enum { FEW = 4096 };

static void declare(struct sim *sim, void *state)
{
    (void)state;
    for (int s = 0; s < N_SPECIES; s++) {
        struct species *table = &sim->species[s];
        const enum column columns[] = {COLUMN_acc, COLUMN_acc_old, COLUMN_rung, COLUMN_rung0};
        for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) species_need(table, columns[c]);
        if (species_has(table, COLUMN_du)) species_need(table, COLUMN_du_old);
    }
}

/* Every rank predicts the rows of the others too, so that all see the same positions. */
static void predict(struct sim *sim, void *state)
{
    (void)state;
    for_species(sim, s) {
#pragma omp parallel for if (s->n_ending > FEW)
        for (int64_t e = 0; e < s->n_ending; e++) {
            int64_t i = s->ending[e];
            double t = timeline_step(&sim->time, s->rung0[i]);
            for (int k = 0; k < 3; k++) {
                double a = s->acc[i][k];
                s->pos[i][k] = integrate_position(s->pos[i][k], s->vel[i][k], a, t);
                s->vel[i][k] = integrate_velocity(s->vel[i][k], a, t);
            }
            if (s->u && s->du) s->u[i] = integrate_energy(s->u[i], s->du[i], (float)t);
        }
    }
}

/* Once the rows lie where they stay for this step: room for the new accelerations. */
static void arrange(struct sim *sim, void *state)
{
    (void)state;
    for_species(sim, s)
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            for (int k = 0; k < 3; k++) {
                s->acc_old[i][k] = s->acc[i][k];
                s->acc[i][k] = 0;
            }
            if (s->du) {
                s->du_old[i] = s->du[i];
                s->du[i] = 0;
            }
        }
}

static void correct(struct sim *sim, bool shift)
{
    for_species(sim, s) {
#pragma omp parallel for if (s->n_active > FEW)
        for (int64_t a = 0; a < s->n_active; a++) {
            int64_t i = s->active[a];
            double t = timeline_step(&sim->time, s->rung0[i]);
            for (int k = 0; k < 3; k++) {
                double change = integrate_correction(s->acc_old[i][k], s->acc[i][k], t);
                s->vel[i][k] += change;
                if (shift) s->pos[i][k] += integrate_shift(change, t);
            }
            if (s->u && s->du) s->u[i] = integrate_energy(s->u[i], s->du[i] - s->du_old[i], 0.5f * (float)t);
        }
    }
}

static void correct_leapfrog(struct sim *sim, void *state)
{
    (void)state;
    correct(sim, false);
}

static void correct_pec(struct sim *sim, void *state)
{
    (void)state;
    correct(sim, true);
    if (sim->time.tick > 0) sim->fresh_potential = false;   /* the rows have moved */
}

/* The fastest oscillations that the step criteria leave, in omega dt. A row swings through its softening length with
 * omega^2 = |a|/eps, a gas row through its kernel with |a|/h: steps of eta sqrt(2 eps/|a|) make that sqrt(2) eta. Sound
 * of the wavelength of two rows has omega = pi c/d, and dt = C h/(2c) with h = 1.14 d of 50 neighbours. */
static void warn_beyond(const struct sim *sim, double stable)
{
    const double swing = sqrt(2), sound = 0.5 * M_PI * 1.14;
    const struct { const char *name; double factor; } criteria[] = {
        {"time_step", swing}, {"acceleration", swing}, {"courant", sound}};
    for (size_t c = 0; c < sizeof criteria / sizeof *criteria; c++) {
        const double value = sim_real(sim, criteria[c].name, 0), z = value * criteria[c].factor;
        if (z > stable && !sim->time.classic)
            log_warning("%s = %g lets rows swing with omega dt = %.2f; this integrator is stable up to %.2f", criteria[c].name,
                        value, z, stable);
    }
}

static void warn_leapfrog(struct sim *sim, void *state)
{
    (void)state;
    warn_beyond(sim, 2);
}

static void warn_pec(struct sim *sim, void *state)
{
    (void)state;
    warn_beyond(sim, sim->time.evaluations > 1 ? 2 : sqrt(2));
}

const struct module leapfrog_module = {
    .name = "leapfrog", .doc = "kick-drift-kick, time-reversible", .kind = MODULE_INTEGRATOR,
    .declare = declare, .warn = warn_leapfrog,
    .hook = {[HOOK_PREDICT] = predict, [HOOK_ARRANGE] = arrange, [HOOK_CORRECT] = correct_leapfrog},
};

const struct module pec_module = {
    .name = "pec", .doc = "predictor-corrector with one evaluation a step", .kind = MODULE_INTEGRATOR,
    .declare = declare, .warn = warn_pec,
    .hook = {[HOOK_PREDICT] = predict, [HOOK_ARRANGE] = arrange, [HOOK_CORRECT] = correct_pec},
};
