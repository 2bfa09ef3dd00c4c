/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `cooling`: radiative cooling and heating of the gas, split from hydrodynamics. Over the
 * step that CORRECT has closed u follows the cooling curve at the density found at its end, exactly
 * (cooling_curve.h, doc/manual/cooling.md). What leaves the gas and what heats it is booked. */
#include "cooling.h"
#include "comm.h"
#include "constants.h"
#include "cooling_curve.h"
#include "cooling_engine.h"
#include "data.h"
#include "device.h"
#include "file/layout.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "sph/sph.h"
#include <math.h>

enum curve { TABLE, KOYAMA_INUTSUKA };
static const char *const reservoir_names[N_RESERVOIRS] = {"radiated", "heated_photo", "heated_floor"};

struct cooling {
    /* Parameters. */
    int curve;
    char *table;
    double floor, metallicity, photoelectric, mu, hydrogen;
    /* State. */
    struct cooling_table *data;
    struct cooling_curve **bin;     /* by [Fe/H], from first_bin upwards; one where all gas is the same */
    int n_bins;
    struct cooling_law law;         /* of the same */
    struct cooling_engine *engine;  /* on a device; made at the first step there */
    double booked[N_RESERVOIRS];    /* of all ranks, since the start; negative where the gas gained */
    bool beyond;                    /* gas hotter than the table was met, on any rank */
};

static const struct param params[] = {
    {"curve", PARAM_CHOICE, "", "table", 0, 0, "table|koyama_inutsuka",
     "table: by temperature and metallicity; koyama_inutsuka: two phases, with heating (2002, solar)", false,
     offsetof(struct cooling, curve)},
    {"table", PARAM_PATH, "", "none", 0, 0, NULL,
     "file with a table of one's own; default: Sutherland & Dopita 1993, collisional ionisation equilibrium", false,
     offsetof(struct cooling, table)},
    {"floor", PARAM_REAL, "temperature", "none", 10, 1e9, NULL,
     "lowest temperature, to which colder gas is raised; default: 1e4 K, or 10 K with koyama_inutsuka. Below 1e4 K the "
     "table is continued with Dalgarno & McCray 1972", true, offsetof(struct cooling, floor)},
    {"metallicity", PARAM_REAL, "", "0.02", 0, 1, NULL,
     "mass fraction of metals, where no module follows those of each row", true, offsetof(struct cooling, metallicity)},
    {"photoelectric", PARAM_REAL, "", "none", 0, 1e6, NULL,
     "heating by dust in units of 2e-26 erg/s a hydrogen nucleus; default: 0, or 1 with koyama_inutsuka", true,
     offsetof(struct cooling, photoelectric)},
    {"constant_mu", PARAM_REAL, "", "none", 0.1, 10, NULL,
     "one mean mass of a particle, in proton masses, instead of the table's (for tests)", false,
     offsetof(struct cooling, mu)},
    {"hydrogen", PARAM_REAL, "", "none", 0.01, 1, NULL,
     "one mass fraction of hydrogen instead of the table's (for tests), and 0.76 where others tell n_H", false,
     offsetof(struct cooling, hydrogen)},
    {0}
};

static const struct saved saved[] = {
    {"booked", offsetof(struct cooling, booked), sizeof((struct cooling *)0)->booked}, {0}};

static const char *const requires[] = {"sph", NULL};

/* Bins of [Fe/H], 0.1 apart, hit every column of the table; the first is gas without metals. */
static const double first_bin = -5, bin_width = 0.1, last_bin = 0.5;

static void declare(struct sim *sim, void *state)
{
    struct cooling *cooling = state;
    bool koyama = cooling->curve == KOYAMA_INUTSUKA;
    sph_need_energy(sim, "cooling");
    if (!sim->units.physical)
        problems_add(&sim->problems, "cooling needs physical units, such as units: {length: kpc, mass: 1e10 Msun, "
                     "velocity: km/s}: this scene is dimensionless");
    if (isnan(cooling->floor)) cooling->floor = koyama ? 10 : 1e4;
    if (isnan(cooling->photoelectric)) cooling->photoelectric = koyama ? 1 : 0;
    char *path = cooling->table ? mem_text("cooling", cooling->table)
                                : data_path("cooling_tables/sutherland_dopita_1993.txt");
    cooling->data = cooling_table_read(path, &sim->problems);
    mem_free(path);
}

static struct cooling_curve *make_curve(const struct cooling *cooling, double feh, double gamma)
{
    struct cooling_samples *samples = mem_alloc("cooling", sizeof *samples);
    struct cooling_gas gas = {gamma, cooling->mu, cooling->hydrogen, cooling->floor,
                              cooling->photoelectric * COOLING_KOYAMA_HEATING};
    const double coldest = pow(10, cooling->data->log_t[0]);
    if (cooling->curve == KOYAMA_INUTSUKA) cooling_table_sample_koyama(cooling->data, feh, samples);
    else if (cooling->floor < coldest * (1 - 1e-9)) cooling_table_sample_low(cooling->data, feh, samples);
    else cooling_table_sample(cooling->data, feh, samples);
    struct cooling_curve *curve = cooling_curve_new(samples, &gas);
    mem_free(samples);
    return curve;
}

static const struct cooling_curve *curve_of(const struct cooling *cooling, const struct species *gas, int64_t i)
{ return cooling_curve_of(&cooling->law, gas, i); }

/* Temperatures of the start with the table's mass of a particle instead of a constant one. */
static void correct_start(struct sim *sim, const struct cooling *cooling)
{
    struct species *gas = &sim->species[GAS];
    double kelvin = layout_kelvin(sim);
    for (int64_t i = species_from(gas); i < species_to(gas); i++)
        gas->u[i] = (float)(cooling_curve_u(curve_of(cooling, gas, i), kelvin * (double)gas->u[i]) / cooling->law.energy);
}

/* All gas on one curve, or one for each bin of metallicity if another module follows the metals. */
static void begin(struct sim *sim, void *state)
{
    struct cooling *cooling = state;
    const struct sph *sph = sim_state(sim, "sph");
    bool followed = species_has(&sim->species[GAS], COLUMN_metals);
    cooling->n_bins = followed ? 1 + (int)lround((last_bin - first_bin) / bin_width) : 1;
    cooling->bin = mem_array("cooling", struct cooling_curve *, cooling->n_bins);
    for (int b = 0; b < cooling->n_bins; b++) {
        double feh = followed ? first_bin + b * bin_width : cooling_table_feh(cooling->metallicity);
        cooling->bin[b] = make_curve(cooling, feh, sph->gamma);
    }
    cooling->law = (struct cooling_law){(const struct cooling_curve *const *)cooling->bin, cooling->n_bins, first_bin, bin_width,
                                        units_cgs(&sim->units, "specific_energy"), units_cgs(&sim->units, "density"),
                                        units_cgs(&sim->units, "time")};
    if (sim->kelvin) correct_start(sim, cooling);
}

static void end(struct sim *sim, void *state)
{
    struct cooling *cooling = state;
    (void)sim;
    cooling_engine_free(cooling->engine);
    for (int b = 0; b < cooling->n_bins; b++) cooling_curve_free(cooling->bin[b]);
    mem_free(cooling->bin);
    cooling_table_free(cooling->data);
}

double cooling_time(const struct sim *sim, int64_t row)
{
    const struct cooling *cooling = sim_state(sim, "cooling");
    const struct species *gas = &sim->species[GAS];
    if (!cooling) return INFINITY;
    double u = (double)gas->u[row] * cooling->law.energy, rho = (double)gas->rho[row] * cooling->law.density;
    double rate = cooling_curve_rate(curve_of(cooling, gas, row), u, rho);
    return rate < 0 ? u / -rate / cooling->law.time : INFINITY;
}

double cooling_hydrogen(const struct sim *sim)
{
    const struct cooling *cooling = sim_state(sim, "cooling");
    return cooling && !isnan(cooling->hydrogen) ? cooling->hydrogen : CONST_HYDROGEN;
}

/* Told once, by whatever rank the gas is met. */
static void warn_beyond(struct cooling *cooling, float u)
{
    const double table_end = pow(10, cooling->data->log_t[cooling->data->n_t - 1]);
    double most = cooling_curve_temperature(cooling->bin[0], (double)u * cooling->law.energy);
    if (cooling->beyond) return;
    comm_max(&most, 1);
    cooling->beyond = most > table_end;
    if (cooling->beyond) log_warning("cooling: gas is hotter than the table's %.3g K: continued with T^(1/2)", table_end);
}

/* The rows' losses on the CPU; the largest u that they begin with. */
static float cool_here(const struct sim *sim, const struct cooling *cooling, double sum[N_RESERVOIRS])
{
    enum { BLOCK = 1024 };
    const struct species *gas = &sim->species[GAS];
    float hottest = 0;
    int64_t blocks = (gas->n_active + BLOCK - 1) / BLOCK;
    double (*part)[N_RESERVOIRS] = mem_alloc("cooling", (size_t)blocks * sizeof *part);
#pragma omp parallel for schedule(dynamic) reduction(max : hottest)
    for (int64_t b = 0; b < blocks; b++)
        for (int64_t a = b * BLOCK; a < (b + 1) * BLOCK && a < gas->n_active; a++) {
            const int32_t i = gas->active[a];
            hottest = fmaxf(hottest, gas->u[i]);
            cooling_row(&cooling->law, gas, i, timeline_step(&sim->time, gas->rung0[i]), part[b]);
        }
    for (int64_t b = 0; b < blocks; b++)    /* in order: the same on any number of threads */
        for (int k = 0; k < N_RESERVOIRS; k++) sum[k] += part[b][k];
    mem_free(part);
    return hottest;
}

static const uint64_t reads = COL(rho) | COL(mass) | COL(rung0), changes = COL(u);
static uint64_t read_with(const struct cooling *cooling) { return cooling->n_bins > 1 ? reads | COL(metals) : reads; }

/* The same on the device, where the rows are there; false if the CPU must do it. */
static bool cool_there(struct sim *sim, struct cooling *cooling, double sum[N_RESERVOIRS], float *hottest)
{
    if (!sim_device(sim) || !rows_are_there(&sim->species[GAS], COL(u) | COL(rho))) return false;
    const struct species rows = rows_there(sim, GAS, read_with(cooling), changes);
    if (!cooling->engine) cooling->engine = cooling_engine_create(sim->device, &cooling->law);
    cooling_engine_advance(cooling->engine, &sim->time, &rows, sum, hottest);
    const char *error = device_error(sim->device);
    return !error || !sim_leave_device(sim, "cooling", error);
}

static void source(struct sim *sim, void *state)
{
    struct cooling *cooling = state;
    double sum[N_RESERVOIRS] = {0};
    float hottest = 0;
    if (!cool_there(sim, cooling, sum, &hottest)) {
        rows_here(sim, GAS_BIT, read_with(cooling), changes);
        hottest = cool_here(sim, cooling, sum);
    }
    warn_beyond(cooling, hottest);
    comm_sum(sum, N_RESERVOIRS);
    for (int k = 0; k < N_RESERVOIRS; k++) cooling->booked[k] += sum[k];
}

/* What is booked is that of all ranks, and a checkpoint gives it to each: one of them tells. */
static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct cooling *cooling = state;
    (void)sim;
    for (int k = 0; k < N_RESERVOIRS; k++)
        if (k != HEATED_PHOTO || cooling->photoelectric > 0)
            sink->add(sink, reservoir_names[k], comm_rank() == 0 ? cooling->booked[k] : 0);
}

static void temperature(const struct sim *sim, const void *state, float *kelvin)
{
    const struct cooling *cooling = state;
    const struct species *gas = &sim->species[GAS];
    for (int64_t i = species_from(gas); i < species_to(gas); i++)
        kelvin[i - species_from(gas)] =
            (float)cooling_curve_temperature(curve_of(cooling, gas, i), (double)gas->u[i] * cooling->law.energy);
}

static void warn(struct sim *sim, void *state)
{
    const struct cooling *cooling = state;
    const struct cooling_table *data = cooling->data;
    const bool koyama = cooling->curve == KOYAMA_INUTSUKA, followed = species_has(&sim->species[GAS], COLUMN_metals);
    double feh = cooling_table_feh(cooling->metallicity);
    if (!koyama && !followed && (feh < data->feh[0] || feh > data->feh[data->n_z - 1]))
        log_warning("cooling.metallicity = %g: [Fe/H] = %.2f is beyond the table, whose nearest column is taken",
                    cooling->metallicity, feh);
    if (koyama && (followed || cooling->metallicity != 0.02))
        log_warning("cooling.curve: koyama_inutsuka is of solar metallicity below 1.3e4 K, whatever the gas");
    if (!koyama && cooling->photoelectric > 0)
        log_warning("cooling.photoelectric: heats dust at every temperature and metallicity alike");
}

const struct module cooling_module = {
    .name = "cooling", .doc = "radiative cooling of the gas, exactly integrated", .kind = MODULE_BLOCK,
    .params = params, .requires = requires, .state_bytes = sizeof(struct cooling), .saved = saved,
    .declare = declare, .begin = begin, .end = end, .energy = energy, .temperature = temperature, .warn = warn, .resident = true,
    .hook = {[HOOK_SOURCE] = source},
};
