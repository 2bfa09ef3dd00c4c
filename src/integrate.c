/* SPDX-License-Identifier: GPL-3.0-or-later
 * The integrators as modules. leapfrog: kick-drift-kick. pec: predictor, one evaluation, corrector,
 * the evaluation serving as the next start value (Heun's scheme with one force a step). */
#include "integrate_rows.h"
#include "device.h"
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
HD void loop(const struct sim *sim, const struct species *s, enum integrate_part part)
{
    const bool all = part == INTEGRATE_PREDICT;
    const int32_t *list = all ? s->ending : s->active;
    const int64_t n = all ? s->n_ending : s->n_active;
#pragma omp parallel for if (n > FEW)
    for (int64_t k = 0; k < n; k++) integrate_row(part, &sim->time, s, list[k]);
}

/* What each part reads and writes, and which of it tells where the rows are. */
static const struct { uint64_t home, read, write; } touched[INTEGRATE_PARTS] = {
    [INTEGRATE_PREDICT] = {COL(pos) | COL(vel) | COL(acc), COL(acc) | COL(du) | COL(rung0), COL(pos) | COL(vel) | COL(u)},
    [INTEGRATE_BEGIN] = {COL(vel) | COL(acc), 0, COL(acc) | COL(acc_old) | COL(du) | COL(du_old)},
    [INTEGRATE_CORRECT] = {COL(vel) | COL(acc), COL(acc) | COL(acc_old) | COL(du) | COL(du_old) | COL(rung) | COL(rung0),
                           COL(vel) | COL(u)},
    [INTEGRATE_CORRECT_SHIFT] = {COL(vel) | COL(acc), COL(acc) | COL(acc_old) | COL(du) | COL(du_old) | COL(rung) | COL(rung0),
                                 COL(pos) | COL(vel) | COL(u)},
};

/* On the device where the rows are there; false if the CPU must do it. */
static bool done_there(struct sim *sim, struct species *s, enum integrate_part part)
{
    if (!sim_device(sim) || !rows_are_there(s, touched[part].home)) return false;
    const struct species rows = rows_there(sim, s->kind, touched[part].read, touched[part].write);
    integrate_launch(sim->device, part, &sim->time, &rows);
    const char *error = device_error(sim->device);
    return !error || !sim_leave_device(sim, "integrator", error);
}

static void integrate(struct sim *sim, enum integrate_part part)
{
    for_species(sim, s) {
        if (done_there(sim, s, part)) continue;
        rows_here(sim, 1u << s->kind, touched[part].read, touched[part].write);
        loop(sim, s, part);
    }
}

static void predict(struct sim *sim, void *state)
{
    (void)state;
    integrate(sim, INTEGRATE_PREDICT);
}

/* Once the rows lie where they stay for this step. */
static void arrange(struct sim *sim, void *state)
{
    (void)state;
    integrate(sim, INTEGRATE_BEGIN);
}

static void correct_leapfrog(struct sim *sim, void *state)
{
    (void)state;
    integrate(sim, INTEGRATE_CORRECT);
}

static void correct_pec(struct sim *sim, void *state)
{
    (void)state;
    integrate(sim, INTEGRATE_CORRECT_SHIFT);
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
    .declare = declare, .resident = true, .warn = warn_leapfrog,
    .hook = {[HOOK_PREDICT] = predict, [HOOK_ARRANGE] = arrange, [HOOK_CORRECT] = correct_leapfrog},
};

const struct module pec_module = {
    .name = "pec", .doc = "predictor-corrector with one evaluation a step", .kind = MODULE_INTEGRATOR,
    .declare = declare, .resident = true, .warn = warn_pec,
    .hook = {[HOOK_PREDICT] = predict, [HOOK_ARRANGE] = arrange, [HOOK_CORRECT] = correct_pec},
};
