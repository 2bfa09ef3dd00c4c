/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `gravity`: parameters, settings for an accuracy asked, the force, the potential, the
 * time step of rows without a smoothing length. */
#include "gravity.h"
#include "comm.h"
#include "contact.h"
#include "direct_engine.h"
#include "energy.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "ranks.h"
#include "walk_engine.h"
#include <float.h>
#include <math.h>
#include <string.h>

static const struct param params[] = {
    {"softening", PARAM_REAL, "length", "0", 0, 1e300, NULL,
     "softening length eps of a row (Plummer's; the spline has its support at 2.8 eps)", false,
     offsetof(struct gravity, softening)},
    {"softening_gas", PARAM_REAL, "length", "none", 0, 1e300, NULL, "the same of gas; default: softening", false,
     offsetof(struct gravity, softening_of[GAS])},
    {"softening_cloud", PARAM_REAL, "length", "none", 0, 1e300, NULL, "the same of clouds", false,
     offsetof(struct gravity, softening_of[CLOUD])},
    {"softening_star", PARAM_REAL, "length", "none", 0, 1e300, NULL, "the same of stars", false,
     offsetof(struct gravity, softening_of[STAR])},
    {"softening_dark", PARAM_REAL, "length", "none", 0, 1e300, NULL, "the same of dark matter", false,
     offsetof(struct gravity, softening_of[DARK])},
    {"softening_adaptive", PARAM_FLAG, "", "off", 0, 0, NULL,
     "softening of gas is its smoothing length: the spline ends where the kernel of sph does, at 2h", false,
     offsetof(struct gravity, adaptive)},
    {"softening_kernel", PARAM_CHOICE, "", "plummer", 0, 0, "plummer|spline",
     "form of the softened force; the spline is exact beyond its support", false,
     offsetof(struct gravity, softening_kernel)},
    {"accuracy", PARAM_REAL, "", "1e-3", 1e-7, 0.3, NULL,
     "99 % of the rows shall have a relative error of the acceleration at or below this", true,
     offsetof(struct gravity, accuracy)},
    {"solver", PARAM_CHOICE, "", "auto", 0, 0, "auto|direct|tree|fmm",
     "direct sum, tree with grouped lists, fast multipoles; auto takes the cheapest", true,
     offsetof(struct gravity, solver)},
    {"opening_angle", PARAM_REAL, "", "none", 0.05, 2, NULL,
     "tree: a cell acts as a whole if its side is below this times its distance; default: from accuracy", true,
     offsetof(struct gravity, opening_angle)},
    {"tolerance", PARAM_REAL, "", "none", 1e-9, 10, NULL,
     "fmm: largest error of one cell over the least acceleration in its target; default: from accuracy", true,
     offsetof(struct gravity, tolerance)},
    {"order", PARAM_COUNT, "", "none", 1, GRAVITY_ORDER_MAX, NULL,
     "tree: 1 monopoles, 2 quadrupoles; fmm: 3 to 6; default: from accuracy", true,
     offsetof(struct gravity, order)},
    {"group_size", PARAM_COUNT, "", "none", 1, 100000, NULL,
     "rows that share an interaction list, at most; default: measured", true, offsetof(struct gravity, group_size)},
    {"leaf_size", PARAM_COUNT, "", "none", 1, 100000, NULL,
     "rows of a cell that is not opened into cells, at most; default: measured", true,
     offsetof(struct gravity, leaf_size)},
    {"precision", PARAM_CHOICE, "", "auto", 0, 0, "auto|rough|float|double",
     "of pair forces: rough takes the processor's guess of 1/sqrt as it is; auto does so where the accuracy asked "
     "allows it; double only with solver direct, as a reference", true, offsetof(struct gravity, precision)},
    {"mutual", PARAM_FLAG, "", "off", 0, 0, NULL,
     "fmm: cells accept each other by one rule, so that a step of all rows keeps momentum as direct sums do; dearer", false,
     offsetof(struct gravity, mutual)},
    {"time_step", PARAM_REAL, "", "0.1", 1e-4, 10, NULL,
     "eta of the longest step eta sqrt(2 eps/|a|) of rows without a smoothing length (eps: Plummer's); on the front of "
     "doc/charts/time.csv: cold collapse, leapfrog", true,
     offsetof(struct gravity, time_step)},
    {0}
};

/* Plummer's eps of a species, and of a row. */
static double of_species(const struct gravity *g, int kind)
{
    return isnan(g->softening_of[kind]) ? g->softening : g->softening_of[kind];
}

static double softening_of(const struct sim *sim, const struct gravity *g, const struct species *s, int64_t i)
{
    const struct black_holes *holes = black_hole_is(s, i) ? sim_state(sim, "black_holes") : NULL;
    return holes ? holes->softening : of_species(g, s->kind);
}

static const double support_ratio = 2.8;    /* Springel (2005): depth of the spline's well is Plummer's */

/* Half the softening squared: of Plummer's eps, or of the spline's support 2.8 eps. */
static void set_softening(struct sim *sim, struct gravity *g)
{
    const struct black_holes *holes = sim_state(sim, "black_holes");
    const double per_eps = g->softening_kernel == KERNEL_SPLINE ? support_ratio : 1, hole = holes ? per_eps * holes->softening : 0;
    double least = holes ? hole : INFINITY, most = hole;
    g->half_soft2_hole = 0.5 * hole * hole;
    for (int s = 0; s < N_SPECIES; s++) {
        double length = per_eps * of_species(g, s);
        g->half_soft2[s] = 0.5 * length * length;
        if (g->adaptive && s == GAS) continue;
        if (sim->species[s].n == 0 && !sim->species[s].grows) continue;
        least = fmin(least, length);
        most = fmax(most, length);
    }
    sim->tree.blur = isfinite(least) && !g->adaptive ? least : 0;
    bool spline = g->softening_kernel == KERNEL_SPLINE;
    g->form = spline ? SOFT_SPLINE : least == most && least > 0 ? SOFT_COMMON : SOFT_PLUMMER;
    g->support = spline ? most : 0;
    g->far_soft2 = spline || !(most > 0) ? 0 : 0.5 * (least * least + most * most);
    /* Between cells all pairs have one softening; the error of that, 3/2 of the difference of the
     * squares over d^2, stays below a tenth of what is asked. */
    g->near2 = spline || !(most > 0) ? 0 : 15 * 0.5 * (most * most - least * least) / g->accuracy;
}

/* Pair forces are floats: doc/manual/gravity.md, "What it does not do". */
#define FLOAT_ACCURACY 1e-6

/* Rows up to which direct sums are the cheapest: their cost a row (N / 4.5e9 s with the slowest of the
 * machines measured) is below that of a walk with lists (0.5 microseconds). */
enum { DIRECT_ROWS = 2000 };
/* The same on a device, whose direct sums cost N^2 / 1e12 s (half of what its instructions allow, doc/gpu-results.md),
 * while moments and lists are made by the CPU: 0.1 microseconds a row. Computed, not measured. */
enum { DIRECT_ROWS_DEVICE = 50000 };

/* A pair errs by three times the guess of 1/sqrt at most, a sum of many by a hundredth (N = 1e6) or a
 * tenth (3e4) of that (doc/benchmarks.md), unless it nearly cancels: the self-check sees to that. */
static enum gravity_refinement refinement_of(const struct gravity *g)
{
    enum { MANY = 1000 };
    const double asked = isnan(g->tolerance) ? g->accuracy : 4 * g->tolerance;  /* 99 % err by 2.5 to 15 tolerances */
    if (g->precision == PRECISION_ROUGH) return GRAVITY_ROUGH;
    if (g->precision != PRECISION_AUTO || g->opening.solver == SOLVER_DIRECT || g->rows < MANY) return GRAVITY_REFINED;
    return 3 * (double)g->kernels->pair->guess_error <= 2 * asked ? GRAVITY_ROUGH : GRAVITY_REFINED;
}

/* Sources end where targets do; measured: of 32 to 128 rows the cheapest (doc/manual/gravity.md). */
static void set_mutual_sizes(const struct gravity *g, struct gravity_opening *o)
{
    enum { MUTUAL_ROWS = 32 };
    o->group_size = o->leaf_size = g->group_size > 0 ? (int)g->group_size : g->leaf_size > 0 ? (int)g->leaf_size : MUTUAL_ROWS;
}

/* Whether walks are the device's, as long as the rows fit. */
static bool on_device(const struct sim *sim, const struct gravity *g) { return sim->device && !g->adaptive && !g->mutual; }

static void set_opening(struct sim *sim, struct gravity *g)
{
    struct gravity_opening *o = &g->opening;
    const bool device = on_device(sim, g);
    o->solver = (enum gravity_solver)g->solver;
    if (g->rows == 0)
        for_species(sim, s) g->rows += s->n;
    if (o->solver == SOLVER_AUTO)
        o->solver = g->rows <= (device ? DIRECT_ROWS_DEVICE : DIRECT_ROWS) || g->precision == PRECISION_DOUBLE
                  ? SOLVER_DIRECT : SOLVER_FMM;
    gravity_settings(o, g->accuracy);
    if (device && o->solver != SOLVER_DIRECT) o->group_size = WALK_GROUP;
    if (g->order > 0) o->order = (int)g->order;
    if (g->group_size > 0) o->group_size = (int)g->group_size;
    if (g->leaf_size > 0) o->leaf_size = (int)g->leaf_size;
    if (g->mutual && o->solver == SOLVER_FMM) set_mutual_sizes(g, o);
    if (o->leaf_size > o->group_size) o->leaf_size = o->group_size;
    if (!isnan(g->opening_angle)) o->theta = g->opening_angle;
    if (!isnan(g->tolerance)) o->alpha = g->tolerance;
    g->refinement = refinement_of(g);
}

static void check_settings(struct sim *sim, struct gravity *g)
{
    if (g->precision == PRECISION_DOUBLE && g->solver != SOLVER_DIRECT && g->solver != SOLVER_AUTO)
        problems_add(&sim->problems, "gravity.precision: double is a reference, for solver direct only");
    if (g->solver == SOLVER_TREE && g->order > 2)
        problems_add(&sim->problems, "gravity.order: the tree has monopoles (1) and quadrupoles (2)");
    if ((g->solver == SOLVER_FMM || g->solver == SOLVER_AUTO) && g->order > 0 && g->order < GRAVITY_ORDER_MIN)
        problems_add(&sim->problems, "gravity.order: fmm has orders %d to %d", GRAVITY_ORDER_MIN, GRAVITY_ORDER_MAX);
    if (g->solver != SOLVER_TREE && !isnan(g->opening_angle))
        problems_add(&sim->problems, "gravity.opening_angle: only the tree opens by an angle (solver: tree)");
    if (g->adaptive && g->softening_kernel != KERNEL_SPLINE)
        problems_add(&sim->problems, "gravity.softening_adaptive: needs softening_kernel: spline, which ends where a kernel does");
    if (g->adaptive && !isnan(g->softening_of[GAS]))
        problems_add(&sim->problems, "gravity.softening_gas: gas is softened by its smoothing length (softening_adaptive)");
    if (g->mutual && g->solver == SOLVER_TREE)
        problems_add(&sim->problems, "gravity.mutual: is for fmm; direct sums are mutual anyway, the tree's cells act one way");
    if (g->mutual && g->group_size > 0 && g->leaf_size > 0 && g->group_size != g->leaf_size)
        problems_add(&sim->problems, "gravity.leaf_size: with mutual: on, sources end where targets do: group_size, or none");
    if (g->solver != SOLVER_FMM && !isnan(g->tolerance))
        problems_add(&sim->problems, "gravity.tolerance: only the fmm opens by an error (solver: fmm)");
}

void gravity_leave_forces(struct sim *sim, struct gravity *g)
{
    g->left = true;
    if (g->solver != SOLVER_DIRECT && g->solver != SOLVER_AUTO)
        problems_add(&sim->problems, "gravity.solver: the integrator sums directly: direct or auto");
    if (g->softening_kernel == KERNEL_SPLINE)
        problems_add(&sim->problems, "gravity.softening_kernel: the integrator needs plummer, whose derivatives it has");
    g->solver = SOLVER_DIRECT;
    g->precision = PRECISION_DOUBLE;
}

static void declare(struct sim *sim, void *state)
{
    struct gravity *g = state;
    check_settings(sim, g);
    g->kernels = gravity_kernels_find(isa_now());
    g->G = sim->units.G;
    g->scale = 1;
    g->built = -1;
    g->measured = NAN;
    for (int s = 0; s < N_SPECIES; s++) {
        species_need(&sim->species[s], COLUMN_pot);
        species_need(&sim->species[s], COLUMN_grav);
    }
}

void gravity_configure(struct sim *sim, struct gravity *g)
{
    set_softening(sim, g);
    set_opening(sim, g);
    int width = gravity_moments_width(&g->opening);
    sim->tree.width[NODE_moment] = sim->tree.width[NODE_cell] = sim->tree.width[NODE_least] = 0;
    if (g->opening.solver == SOLVER_DIRECT) {
        sim->whole = "direct sums of gravity";
    } else {
        if (width > 0) tree_need(&sim->tree, NODE_moment, width);
        tree_need(&sim->tree, NODE_cell, (int)sizeof(struct gravity_cell));
        tree_need(&sim->tree, NODE_least, 1);
        sim->tree.largest_group = g->opening.group_size;
    }
    tree_need_leaf(&sim->tree, g->opening.leaf_size);
}

/* What was picked and what it costs; with explicit settings there is nothing to say. */
static void tell_settings(const struct gravity *g, bool device)
{
    const struct gravity_opening *o = &g->opening;
    if (o->solver == SOLVER_DIRECT || g->order > 0 || !isnan(g->opening_angle) || !isnan(g->tolerance)) return;
    const struct gravity_front *front = gravity_settings_row(o->solver, g->accuracy);
    char *cost = device ? mem_text("gravity", "on the device")
                        : mem_format("gravity", "%.2f microseconds of CPU a row", front->cpu);
    log_line("gravity: accuracy %g: %s order %d, %s %.3g, groups of %d, leaves of %d, %s pairs (row \"%s\" of "
             "doc/charts/gravity.csv: 99 %% err by %.1e at most, %s)", g->accuracy,
             o->solver == SOLVER_FMM ? "fmm" : "tree", o->order, o->solver == SOLVER_FMM ? "tolerance" : "angle",
             o->solver == SOLVER_FMM ? o->alpha : o->theta, o->group_size, o->leaf_size,
             !device && g->refinement == GRAVITY_ROUGH ? "rough" : "refined", front->row, front->p99, cost);
    mem_free(cost);
}

/* The rows are there: the solver may depend on their number. */
static void begin(struct sim *sim, void *state)
{
    const struct gravity *g = state;
    gravity_configure(sim, state);
    tell_settings(g, on_device(sim, g));
    if (g->adaptive && !(species_has(&sim->species[GAS], COLUMN_h) && sim->tree.width[NODE_h_max] > 0))
        problems_add(&sim->problems, "gravity.softening_adaptive: there are no smoothing lengths without a block sph");
    if (sim->device && (g->adaptive || g->mutual || g->precision == PRECISION_DOUBLE))
        log_line("gravity: %s is the CPU's", g->adaptive ? "softening_adaptive" : g->mutual ? "mutual" : "precision double");
    if (g->mutual && g->opening.solver == SOLVER_FMM)
        log_line("gravity: mutual: momentum is kept where the steps of all rows end together, to 1e-7 of the forces; steps of "
                 "fewer rows keep it within their errors alone (time.steps: common has none)");
}

static void end(struct sim *sim, void *state)
{
    (void)sim;
    struct gravity *g = state;
    direct_engine_free(g->engine);
    walk_engine_free(g->walk_engine);
    gravity_walk_free(g);
    gravity_rows_free(g);
}

/* Squares over the whole set, and powers -3/2 of the squares of close pairs, are still floats. */
static void set_unit(const struct sim *sim, struct gravity *g)
{
    g->unit = ldexp(sim->tree.side, -20);
    const double length2 = g->far_soft2 / (g->unit * g->unit);
    g->pair_form = g->form == SOFT_COMMON && length2 < 1e-12 ? SOFT_PLUMMER : g->form;
}

/* What the walks read of rows, and the step criterion. */
static const uint64_t sources = COL_MOTION | COL(mass) | COL(id) | COL(h) | COL(grav) | COL(hole);

static void arrange(struct sim *sim, void *state)
{
    struct gravity *g = state;
    rows_here(sim, ALL_SPECIES, sources, 0);
    set_unit(sim, g);
    if (g->opening.solver == SOLVER_DIRECT || sim->tree.n_nodes == 0) return;
    if (g->n_cells != sim->tree.n_fixed || sim->tree.built == sim->time.tick) gravity_moments_build(sim, g);
    else gravity_moments_refit(sim, g);
}

static void compute(struct sim *sim, struct gravity *g, enum gravity_output output)
{
    if (sim->tree.n_nodes == 0) return;
    if (g->opening.solver == SOLVER_DIRECT) gravity_direct(sim, g, output);
    else if (g->adaptive || g->mutual || !sim_device(sim) || !gravity_walk_device(sim, g, output)) gravity_walk(sim, g, output);
}

/* The first force of a run has no accelerations to measure its errors by: a walk by angles alone
 * finds their size. */
static void learn(struct sim *sim, struct gravity *g)
{
    if (g->opening.solver != SOLVER_FMM || g->known || sim->tree.n_nodes == 0) return;
    compute(sim, g, OUTPUT_SIZE);
    if (!sim->spread) ranks_share(sim, (uint64_t)1 << COLUMN_grav);
    g->known = 1;
    gravity_moments_least(sim, g);
}

static void force(struct sim *sim, void *state)
{
    struct gravity *g = state;
    if (g->left) return;
    rows_here(sim, ALL_SPECIES, sources, COL(acc) | COL(grav) | (sim->want_potential ? COL(pot) : 0));
    gravity_moments_open(sim, g);   /* others have asked for cells since */
    if (g->adaptive) g->epoch++;    /* rows were staged for their moments, before they had this step's h */
    learn(sim, g);
    struct gravity_sample *sample = gravity_check_due(sim, g) ? gravity_check_begin(sim, g) : NULL;
    compute(sim, g, OUTPUT_FORCE);
    if (sample) {
        while (!gravity_check_passes(sim, g, sample)) compute(sim, g, OUTPUT_FORCE);
        gravity_check_end(sample);
    }
    if (sim->want_potential) sim->fresh_potential = true;
}

static void potential(struct sim *sim, void *state)
{
    struct gravity *g = state;
    g->epoch++;     /* rows may have moved since the force */
    gravity_moments_open(sim, g);
    compute(sim, g, OUTPUT_POTENTIAL);
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct gravity *g = state;
    if (g->precision == PRECISION_DOUBLE) sink->add(sink, "potential", 0.5 * g->bound);
    else for_species(sim, s) sink->add(sink, "potential", 0.5 * energy_of_rows(s, s->pot));
}

/* Rows that no smoothing length limits (collisionless ones): free fall over their softening length. */
static void reason(const struct sim *sim, const void *state, const struct species *s, int64_t i, struct step_reason *step)
{
    const struct gravity *g = state;
    double eps = softening_of(sim, g, s, i);
    if (s->h || g->left || !(eps > 0)) return;
    const float *acc = s->acc[i];
    double size = sqrt((double)acc[0] * (double)acc[0] + (double)acc[1] * (double)acc[1] + (double)acc[2] * (double)acc[2]);
    double dt = g->time_step * sqrt(2 * eps / size);
    if (dt < step->dt) *step = (struct step_reason){dt, "gravity.time_step"};
}

static void limit(struct sim *sim, void *state)
{
    for_species(sim, s) {
        if (s->h) continue;
        rows_here(sim, 1u << s->kind, COL(acc) | COL(mass) | COL(hole), COL(dt));
        for (int64_t a = 0; a < s->n_active; a++) {
            struct step_reason step = {(double)s->dt[s->active[a]], NULL};
            reason(sim, state, s, s->active[a], &step);
            s->dt[s->active[a]] = fminf(s->dt[s->active[a]], (float)step.dt);
        }
    }
}

/* Positions are doubles about the origin: how far from it the rows lie and how large the set is. */
static void warn_distance(const struct sim *sim, const struct gravity *g)
{
    double most[6], far = 0, extent = 0;    /* of -x and x */
    for (int k = 0; k < 6; k++) most[k] = -INFINITY;
    for_species(sim, s)
        for (int64_t i = species_from(s); i < species_to(s); i++)
            for (int k = 0; k < 3; k++) {
                most[k] = fmax(most[k], -s->pos[i][k]);
                most[3 + k] = fmax(most[3 + k], s->pos[i][k]);
            }
    ranks_max(sim, most, 6);
    for (int k = 0; k < 6; k++) far = fmax(far, most[k]);
    for (int k = 0; k < 3; k++) extent = fmax(extent, most[3 + k] + most[k]);
    const double step = far * DBL_EPSILON, spacing = extent / cbrt(fmax((double)g->rows, 1));
    const double matters = sim->tree.blur > 0 ? fmin(sim->tree.blur, spacing) : spacing;
    if (extent > 0 && step > 1e-3 * matters)
        log_warning("gravity: the rows lie %.1e of their extent from the origin: doubles resolve %.1e there, which is %.1e of "
                    "the softening or of the distance of rows; move the origin to them", far / extent, step, step / matters);
}

/* Explicit openings beyond which single rows err by more than 15 %: doc/manual/gravity.md, "Where it fails". */
static void warn_opening(const struct gravity *g)
{
    const double widest_angle = 0.8, loosest = 1e-2;
    if (g->opening.solver == SOLVER_TREE && g->opening_angle > widest_angle)
        log_warning("gravity.opening_angle = %g: above %g single rows of a clumped set err by up to 80 %%; give an accuracy "
                    "instead", g->opening_angle, widest_angle);
    if (g->opening.solver == SOLVER_FMM && g->tolerance > loosest)
        log_warning("gravity.tolerance = %g: above %g single rows of a clumped set err by up to 80 %%; give an accuracy "
                    "instead", g->tolerance, loosest);
}

/* Settings of which the run cannot hold what the scene seems to ask. */
static void warn(struct sim *sim, void *state)
{
    const struct gravity *g = state;
    for_species(sim, s) {
        double eps = of_species(g, s->kind);
        if (s->n > 1 && !s->h && !g->left && !(eps > 0))
            log_warning("gravity.softening of %s is 0: nothing but time.dt_max limits the steps of these rows, and close "
                        "pairs will gain energy; give a softening", species_names[s->kind]);
    }
    warn_opening(g);
    warn_distance(sim, g);
    if (g->precision != PRECISION_DOUBLE && g->accuracy < FLOAT_ACCURACY)
        log_warning("gravity.accuracy = %g is beyond single precision (about %g); solver: direct with precision: double "
                    "reaches it", g->accuracy, FLOAT_ACCURACY);
    if (g->opening.solver == SOLVER_DIRECT && (g->order > 0 || g->leaf_size > 0 || g->group_size > 0))
        log_warning("gravity: direct sums have no order, leaf_size or group_size: these settings do nothing");
}

static const struct saved saved[] = {
    {"scale", offsetof(struct gravity, scale), sizeof(double)},
    {"rows", offsetof(struct gravity, rows), sizeof(int64_t)},
    {"known", offsetof(struct gravity, known), sizeof(int64_t)},
    {"checked", offsetof(struct gravity, checked), sizeof(int64_t)},
    {"refined", offsetof(struct gravity, refined), sizeof(int64_t)},
    {0}
};

const struct module gravity_module = {
    .name = "gravity", .open_space = true, .doc = "self-gravity: direct sum, tree or fast multipoles", .params = params,
    .state_bytes = sizeof(struct gravity), .saved = saved, .declare = declare, .begin = begin, .end = end,
    .resident = true, .hook = {[HOOK_ARRANGE] = arrange, [HOOK_FORCE] = force, [HOOK_LIMIT] = limit},
    .potential = potential, .energy = energy, .reason = reason, .warn = warn,
};
