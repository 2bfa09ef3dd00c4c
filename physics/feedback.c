/* SPDX-License-Identifier: GPL-3.0-or-later
 * The module `feedback`: star rows are populations that return mass, elements and energy to the gas
 * around them (populations.h, doc/manual/feedback.md). What is due at the end of a star's step follows from
 * its age and from what it has paid; it is paid once it is worth the search for gas, or stays in the row. */
#include "comm.h"
#include "constants.h"
#include "cooling.h"
#include "deposit.h"
#include "file/layout.h"
#include "log.h"
#include "mem.h"
#include "module.h"
#include "populations.h"
#include "random.h"
#include "ranks.h"
#include "sph/sph.h"
#include "supernova.h"
#include <math.h>
#include <string.h>

_Static_assert((int)N_ELEMENTS == (int)END_ELEMENTS - (int)FIRST_ELEMENT, "a column for each element");
static enum column element_column(int e) { return (enum column)(FIRST_ELEMENT + e); }

struct feedback {
    /* Parameters. */
    int imf, snii, snia;
    char *elements;
    double binaries, snia_number, efficiency, energy, nebula, portion, discrete, metallicity, wind_power, wind_loss;
    double age, time_step;
    bool winds;
    double heating, momentum;
    int64_t neighbours;
    int form;                                   /* enum deposit_form */
    /* State. */
    bool follows[N_ELEMENTS];                   /* the elements that have columns */
    struct population *population;
    struct deposit_wishes wishes;
    double rise;                                /* of u by `heating` */
    double years, suns, erg;                    /* code units of time, mass and energy in years, Msun and erg */
    /* Since the start, of all ranks: energy given to the gas, mass, events, and their number at the last row of
     * budget.csv with its time. */
    double injected[N_POPULATION_CAUSES], returned[N_POPULATION_CAUSES], events[N_POPULATION_CAUSES];
    double told[N_POPULATION_CAUSES], at;
    double made[N_ELEMENTS];                    /* masses of elements made in stars */
    double lifted;                              /* fall of the potential energy of what went from stars to gas */
    int64_t unpaid;                             /* times that a star found no gas */
};

static const struct param params[] = {
    {"imf", PARAM_CHOICE, "", "kroupa1993", 0, 0, IMF_CHOICES, "initial mass function of the stars", false,
     offsetof(struct feedback, imf)},
    {"snii", PARAM_CHOICE, "", "raiteri1996", 0, 0, POPULATION_SNII_CHOICES,
     "yields of supernovae II: fits for oxygen and iron, 8 to 40 Msun (Raiteri et al. 1996), or all elements, 8 to 100 Msun, at "
     "five metallicities (Portinari et al. 1998)", false, offsetof(struct feedback, snii)},
    {"elements", PARAM_TEXT, "", "O, Fe", 0, 0, NULL,
     "that are followed beside the sum of all metals: of O, Fe, C, N, Ne, Mg, Si, S, Ca; all but the first two need "
     "snii: portinari1998", false, offsetof(struct feedback, elements)},
    {"snia", PARAM_CHOICE, "", "binary", 0, 0, POPULATION_SNIA_CHOICES,
     "supernovae Ia: binaries (Greggio & Renzini 1983), a law of delays (Maoz et al. 2012), or none", false,
     offsetof(struct feedback, snia)},
    {"binaries", PARAM_REAL, "", "0.05", 0, 1, NULL, "part of the systems of 3 to 16 Msun that are binaries which explode",
     false, offsetof(struct feedback, binaries)},
    {"snia_number", PARAM_REAL, "", "1.3e-3", 0, 1, NULL, "supernovae Ia of the law of delays per Msun in 13.8 Gyr", false,
     offsetof(struct feedback, snia_number)},
    {"efficiency", PARAM_REAL, "", "0.1", 0, 1, NULL,
     "part of a supernova's energy that the gas receives as heat", true, offsetof(struct feedback, efficiency)},
    {"energy", PARAM_REAL, "", "1e51", 0, 1e54, NULL, "energy of a supernova in erg", true, offsetof(struct feedback, energy)},
    {"variant", PARAM_CHOICE, "", "thermal", 0, 0, "thermal|stochastic|momentum",
     "heat for all neighbours; for some, at random, enough to be hot; or radial momentum", true,
     offsetof(struct feedback, form)},
    {"heating", PARAM_REAL, "temperature", "3.16e7 K", 1e4, 1e10, NULL,
     "stochastic: by how much gas is heated (with a mean molecular weight of 0.6)", true, offsetof(struct feedback, heating)},
    {"momentum", PARAM_REAL, "momentum", "none", 0, 1e300, NULL,
     "momentum: of a supernova where n_H = 1 cm^-3, falling as n_H^-0.17; default: 2.8e5 Msun km/s (Kim & Ostriker 2015, eq. 34)",
     true, offsetof(struct feedback, momentum)},
    {"nebula", PARAM_REAL, "", "1e47", 0, 1e54, NULL, "energy of a planetary nebula in erg", true,
     offsetof(struct feedback, nebula)},
    {"winds", PARAM_FLAG, "", "off", 0, 0, NULL, "stars of 8 to 40 Msun have winds before they explode", false,
     offsetof(struct feedback, winds)},
    {"wind_power", PARAM_REAL, "", "1e35", 0, 1e40, NULL, "of one such star in erg/s, of which the gas receives `efficiency`", true,
     offsetof(struct feedback, wind_power)},
    {"wind_loss", PARAM_REAL, "", "1e-6", 1e-12, 1e-3, NULL,
     "mass loss of one such star in Msun a year, until half of what would explode is gone", false,
     offsetof(struct feedback, wind_loss)},
    {"neighbours", PARAM_COUNT, "", "50", 1, NEAREST_MOST, NULL, "gas rows that share what a star returns", true,
     offsetof(struct feedback, neighbours)},
    {"portion", PARAM_REAL, "", "1e-4", 0, 0.1, NULL,
     "part of the mass of its stars that a row returns at once; less stays in the row until it has come together", true,
     offsetof(struct feedback, portion)},
    {"discrete", PARAM_REAL, "mass", "none", 0, 1e300, NULL,
     "stars of less mass have whole numbers of supernovae, drawn at random; default: 1e3 Msun", true,
     offsetof(struct feedback, discrete)},
    {"metallicity", PARAM_REAL, "", "0.02", 0, 1, NULL,
     "mass fraction of metals, in solar proportions, of rows that have none at the start", false,
     offsetof(struct feedback, metallicity)},
    {"age", PARAM_REAL, "time", "0", 0, 1e300, NULL, "at the start, of stars that come without a mass at birth", false,
     offsetof(struct feedback, age)},
    {"time_step", PARAM_REAL, "", "0.1", 1e-3, 1e3, NULL,
     "longest step of a star row over its age (or 3.3 Myr, when the first stars end): what is due comes in such portions", true,
     offsetof(struct feedback, time_step)},
    {0}
};

#define SAVED(field) {#field, offsetof(struct feedback, field), sizeof((struct feedback *)0)->field}
static const struct saved saved[] = {SAVED(injected), SAVED(returned), SAVED(events), SAVED(told), SAVED(at), SAVED(made),
                                     SAVED(lifted), {0}};
#undef SAVED

static const char *const requires[] = {"sph", NULL};

/* Reads the list; what is wrong with it goes to the scene's problems. */
static void choose_elements(struct sim *sim, struct feedback *feedback)
{
    const char *separators = ", ";
    char *buffer = mem_text("feedback", feedback->elements ? feedback->elements : "");
    feedback->follows[ELEMENT_METALS] = true;
    for (char *next = buffer, *word; (word = strsep(&next, separators));) {
        int e = 1;
        if (!*word) continue;
        while (e < N_ELEMENTS && strcmp(word, element_symbols[e]) != 0) e++;
        if (e == N_ELEMENTS)
            problems_add(&sim->problems, "feedback.elements: no yields of \"%s\" are known: take of O, Fe, C, N, Ne, Mg, Si, S, Ca",
                         word);
        else if (e > ELEMENT_FE && feedback->snii == POPULATION_RAITERI)
            problems_add(&sim->problems, "feedback.elements: raiteri1996 tells oxygen and iron only: %s needs snii: portinari1998",
                         word);
        else
            feedback->follows[e] = true;
    }
    mem_free(buffer);
}

static void declare(struct sim *sim, void *state)
{
    struct feedback *feedback = state;
    static const enum species_kind kinds[] = {GAS, STAR, CLOUD};
    const int with_elements = sim_state(sim, "clouds") ? 3 : 2;
    static const enum column of_stars[] = {COLUMN_birth, COLUMN_mass_born, COLUMN_age_paid};
    choose_elements(sim, feedback);
    for (int s = 0; s < with_elements; s++)
        for (int e = 0; e < N_ELEMENTS; e++)
            if (feedback->follows[e]) species_need(&sim->species[kinds[s]], element_column(e));
    if (feedback->winds && feedback->snii == POPULATION_PORTINARI)
        problems_add(&sim->problems, "feedback.winds: the yields of portinari1998 hold the winds of massive stars already");
    for (int c = 0; c < 3; c++) species_need(&sim->species[STAR], of_stars[c]);
    sph_need_energy(sim, "feedback");
    if (!sim->units.physical) problems_add(&sim->problems, "feedback needs physical units: this scene is dimensionless");
    if (isnan(feedback->momentum))
        feedback->momentum = supernova_momentum(1) * CONST_M_SUN / sim->units.mass * 1e5 / sim->units.velocity;
    if (isnan(feedback->discrete)) feedback->discrete = 1e3 * CONST_M_SUN / sim->units.mass;
}

static bool is_zero(const double *values, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (values[i] != 0) return false;
    return true;
}

/* Rows without metals at the start of a run get them, and elements that a file with metals does not hold become solar in
 * proportion to these (element_solar). */
static void enrich(struct species *s, double metallicity)
{
    if (is_zero(s->metals, s->n))
        for (int64_t i = 0; i < s->n; i++) s->metals[i] = metallicity * s->mass[i];
    for (int e = 0; e < N_ELEMENTS; e++) {
        double *element = species_column(s, element_column(e));
        if (!element || element == s->metals || !is_zero(element, s->n)) continue;
        for (int64_t i = 0; i < s->n; i++) element[i] = element_solar[e] * s->metals[i];
    }
}

/* Mass fractions of a star row, which are those of its birth. */
static void find_birth(const struct species *star, int64_t i, struct population_birth *birth)
{
    for (int e = 0; e < N_ELEMENTS; e++) {
        const double *element = species_column(star, element_column(e));
        birth->element[e] = element ? element[i] / star->mass[i] : 0;
    }
}

/* A row of stars without a history: what is left at `age` of those that were born then. */
static void grow_old(struct sim *sim, const struct feedback *feedback, int64_t i)
{
    struct species *star = &sim->species[STAR];
    const double mass = star->mass[i], now = timeline_now(&sim->time);
    struct population_birth birth;
    struct population_return returned[N_POPULATION_CAUSES];
    double left = 1;
    find_birth(star, i, &birth);
    if (star->birth[i] == 0) star->birth[i] = now - feedback->age;
    population_returned(feedback->population, (now - star->birth[i]) * feedback->years, &birth, returned);
    for (int c = 0; c < N_POPULATION_CAUSES; c++) left -= returned[c].mass;
    star->mass_born[i] = mass / left;
}

static void begin(struct sim *sim, void *state)
{
    struct feedback *feedback = state;
    struct species *star = &sim->species[STAR], *gas = &sim->species[GAS], *cloud = &sim->species[CLOUD];
    struct population_options options = population_defaults();
    options.imf = (enum imf_kind)feedback->imf;
    options.snii = (enum population_snii)feedback->snii;
    options.snia = (enum population_snia)feedback->snia;
    memcpy(options.follows, feedback->follows, sizeof options.follows);
    options.binaries = feedback->binaries;
    options.snia_number = feedback->snia_number;
    options.wind_loss = feedback->winds ? feedback->wind_loss : 0;
    feedback->population = population_new(&options);
    feedback->years = units_cgs(&sim->units, "time") / CONST_YEAR;
    feedback->suns = sim->units.mass / CONST_M_SUN;
    feedback->erg = units_cgs(&sim->units, "energy");
    feedback->rise = feedback->heating / layout_kelvin(sim);
    if (sim->time.tick > 0 || sim->started) return;
    feedback->at = timeline_now(&sim->time);
    if (gas->n > 0) enrich(gas, feedback->metallicity);
    if (star->n > 0) enrich(star, feedback->metallicity);
    if (cloud->n > 0 && cloud->metals) enrich(cloud, feedback->metallicity);
    for (int64_t i = 0; i < star->n; i++) {
        if (star->hole && star->hole[i]) continue;     /* born of no stars */
        if (star->mass_born[i] == 0) grow_old(sim, feedback, i);
        if (star->age_paid[i] == 0) star->age_paid[i] = fmax(timeline_now(&sim->time) - star->birth[i], 0);
    }
}

static void end(struct sim *sim, void *state)
{
    struct feedback *feedback = state;
    (void)sim;
    population_free(feedback->population);
    deposit_free(&feedback->wishes);
}

/* --- what is due --- */

/* What a star row owes, in code units; elements include what its stars were born with. */
struct due {
    double age, mass, energy, advance, element[N_ELEMENTS], made[N_ELEMENTS];
    double mass_by[N_POPULATION_CAUSES], energy_by[N_POPULATION_CAUSES], events_by[N_POPULATION_CAUSES];
    struct nearest nearest;
};

/* A whole number with the given mean, by inversion; means are small. */
static double draw_number(const struct random *key, uint64_t draw, double mean)
{
    double left = random_uniform(key, draw), p = exp(-mean);
    int number = 0;
    for (; left > p && number < 1000; p *= mean / ++number) left -= p;
    return number;
}

/* Events of one cause where `mean` are expected: whole supernovae where the population is small. */
static double events_of(const struct sim *sim, const struct feedback *feedback, int64_t i, int cause, double mean)
{
    const struct species *star = &sim->species[STAR];
    const struct random key = {sim->seed, star->id[i], (uint64_t)sim->time.tick, random_stream("feedback")};
    bool whole = (cause == POPULATION_SNII || cause == POPULATION_SNIA) && star->mass_born[i] < feedback->discrete;
    return whole ? draw_number(&key, (uint64_t)cause, mean) : mean;
}

/* Energy that the gas receives from each of them, of winds for each year, in code units. */
static double energy_of(const struct feedback *feedback, int cause)
{
    if (cause == POPULATION_AGB) return feedback->nebula / feedback->erg;
    if (cause == POPULATION_WIND) return feedback->efficiency * feedback->wind_power * CONST_YEAR / feedback->erg;
    return feedback->efficiency * feedback->energy / feedback->erg;
}

/* Whether another portion has come together in the step that ends: a star without gas near does not search in every step. */
static bool portion_filled(const struct sim *sim, const struct feedback *feedback, int64_t i, const struct population_birth *birth,
                           const struct population_return paid[N_POPULATION_CAUSES], const struct due *due)
{
    const struct species *star = &sim->species[STAR];
    const double portion = feedback->portion * star->mass_born[i], age = due->age - timeline_step(&sim->time, star->rung0[i]);
    struct population_return before[N_POPULATION_CAUSES];
    double earlier = 0;
    if (!(due->mass > portion)) return false;
    if (age <= star->age_paid[i] || portion == 0) return true;
    population_returned(feedback->population, age * feedback->years, birth, before);
    for (int c = 0; c < N_POPULATION_CAUSES; c++) earlier += star->mass_born[i] * fmax(before[c].mass - paid[c].mass, 0);
    return floor(due->mass / portion) > floor(earlier / portion);
}

/* False if nothing is to be paid now. */
static bool find_due(const struct sim *sim, const struct feedback *feedback, int64_t i, struct due *due)
{
    const struct species *star = &sim->species[STAR];
    const double born = star->mass_born[i];
    struct population_birth birth;
    struct population_return now[N_POPULATION_CAUSES], paid[N_POPULATION_CAUSES];
    const double age = timeline_now(&sim->time) - star->birth[i];
    if (!(age > star->age_paid[i] * (1 + feedback->portion / population_fastest(feedback->population)))) return false;
    *due = (struct due){.age = age};
    find_birth(star, i, &birth);
    population_returned(feedback->population, due->age * feedback->years, &birth, now);
    population_returned(feedback->population, star->age_paid[i] * feedback->years, &birth, paid);
    for (int c = 0; c < N_POPULATION_CAUSES; c++) due->mass += due->mass_by[c] = born * fmax(now[c].mass - paid[c].mass, 0);
    if (!portion_filled(sim, feedback, i, &birth, paid, due)) return false;
    for (int c = 0; c < N_POPULATION_CAUSES; c++) {
        double number = born * feedback->suns * fmax(now[c].number - paid[c].number, 0);
        due->events_by[c] = events_of(sim, feedback, i, c, number);
        due->energy += due->energy_by[c] = due->events_by[c] * energy_of(feedback, c);
        for (int e = 0; e < N_ELEMENTS; e++) due->element[e] += born * fmax(now[c].element[e] - paid[c].element[e], 0);
    }
    if (star->advance) {        /* its cloud has had a part of it (cloud_stars) */
        due->advance = fmin(star->advance[i], due->energy_by[POPULATION_SNII]);
        due->energy_by[POPULATION_SNII] -= due->advance;
        due->energy -= due->advance;
    }
    for (int e = 0; e < N_ELEMENTS; e++) due->made[e] = due->element[e] - birth.element[e] * due->mass;
    nearest_gas(sim, star->pos[i], (int)feedback->neighbours, &due->nearest);
    return true;
}

/* --- paying --- */

/* Of the supernovae that are due, at the mean density of the gas around (cooling_hydrogen of it is hydrogen). */
static double momentum_of(const struct sim *sim, const struct feedback *feedback, const struct due *due)
{
    const struct species *gas = &sim->species[GAS];
    const double hydrogen = cooling_hydrogen(sim), cm = units_cgs(&sim->units, "length");
    double rho = 0, number = due->events_by[POPULATION_SNII] + due->events_by[POPULATION_SNIA];
    for (int k = 0; k < due->nearest.n; k++) rho += (double)gas->rho[due->nearest.row[k]] / due->nearest.n;
    double n_h = hydrogen * rho * sim->units.mass / (cm * cm * cm) / CONST_M_PROTON;
    return number * feedback->momentum * supernova_momentum(n_h) / supernova_momentum(1);
}

static void pay(struct sim *sim, struct feedback *feedback, int64_t i, const struct due *due)
{
    struct species *star = &sim->species[STAR];
    struct deposit deposit = {.mass = due->mass, .energy = due->energy, .form = (enum deposit_form)feedback->form,
                              .rise = feedback->rise, .momentum = momentum_of(sim, feedback, due),
                              .key = {sim->seed, star->id[i], (uint64_t)sim->time.tick, random_stream("heating")}};
    if (!deposit_reaches(sim, &due->nearest)) {
        if (feedback->unpaid++ == 0)
            log_line("feedback: star %llu has no gas near: it keeps what is due until it has",
                     (unsigned long long)star->id[i]);
        return;
    }
    feedback->lifted -= deposit_rise(sim, &due->nearest, STAR, i, due->mass, &deposit.key);
    memcpy(deposit.pos, star->pos[i], sizeof deposit.pos);
    memcpy(deposit.vel, star->vel[i], sizeof deposit.vel);
    for (int e = 0; e < N_ELEMENTS; e++) {
        double *element = species_column(star, element_column(e));
        if (!element) continue;
        deposit.element[e] = due->element[e];
        element[i] *= 1 - due->mass / star->mass[i];
        feedback->made[e] += due->made[e];
    }
    star->mass[i] -= due->mass;
    star->age_paid[i] = due->age;
    if (star->advance) star->advance[i] -= due->advance;
    double given = deposit_to_gas(sim, &deposit, &due->nearest, &feedback->wishes);
    for (int c = 0; c < N_POPULATION_CAUSES; c++) {
        if (due->energy > 0) feedback->injected[c] += due->energy_by[c] * (given / due->energy);
        feedback->returned[c] += due->mass_by[c];
        feedback->events[c] += due->events_by[c];
    }
}

/* All ranks hold all rows and do the same for all stars: gas of any rank may receive. The search is
 * shared among threads, stars pay one after the other in row order. */
static void event(struct sim *sim, void *state)
{
    enum { BLOCK = 256 };
    struct feedback *feedback = state;
    const struct species *star = &sim->species[STAR];
    uint64_t keep = 0;
    int64_t n = star->n_ending;
    if (n == 0) return;
    for (int c = 0; c < N_COLUMNS; c++) keep |= (uint64_t)(column_table[c].lifetime == KEEP) << c;
    ranks_share(sim, keep);
    struct due *due = mem_array("feedback", struct due, n < BLOCK ? n : BLOCK);
    bool owes[BLOCK];
    for (int64_t from = 0; from < n; from += BLOCK) {
        int64_t count = n - from < BLOCK ? n - from : BLOCK;
#pragma omp parallel for schedule(dynamic, 4)
        for (int64_t k = 0; k < count; k++) owes[k] = find_due(sim, feedback, star->ending[from + k], &due[k]);
        for (int64_t k = 0; k < count; k++)
            if (owes[k]) pay(sim, feedback, star->ending[from + k], &due[k]);
    }
    mem_free(due);
}

/* The rate at which a population returns changes with its age. */
static double longest_step(const struct sim *sim, const struct feedback *feedback, int64_t i)
{
    const double first_end = 3.3e6;     /* yr: populations.md, section 2 */
    double age = timeline_now(&sim->time) - sim->species[STAR].birth[i];
    if (sim->species[STAR].mass_born[i] == 0) return INFINITY;      /* a black hole */
    return feedback->time_step * fmax(age, first_end / feedback->years);
}

static void limit(struct sim *sim, void *state)
{
    struct feedback *feedback = state;
    struct species *star = &sim->species[STAR];
    for (int64_t a = 0; a < star->n_active; a++) {
        int64_t i = star->active[a];
        star->dt[i] = fminf(star->dt[i], (float)longest_step(sim, feedback, i));
    }
    deposit_wake(sim, &feedback->wishes);
}

static void reason(const struct sim *sim, const void *state, const struct species *s, int64_t i, struct step_reason *step)
{
    double longest = s->kind == STAR ? longest_step(sim, state, i) : INFINITY;
    if (longest < 0.999 * step->dt) *step = (struct step_reason){longest, "feedback.time_step"};
}

/* Winds come last, and only where the scene has them. */
static int told_causes(const struct feedback *feedback)
{
    return feedback->winds ? N_POPULATION_CAUSES : POPULATION_WIND;
}

static void energy(struct sim *sim, void *state, struct energy_sink *sink)
{
    const struct feedback *feedback = state;
    if (sim_state(sim, "gravity")) sink->add(sink, "booked_returned_lifted", comm_rank() == 0 ? feedback->lifted : 0);
    for (int c = 0; c < told_causes(feedback); c++) {
        char name[32];
        snprintf(name, sizeof name, "injected_%s", population_cause_names[c]);
        sink->add(sink, name, comm_rank() == 0 ? -feedback->injected[c] : 0);
    }
}

/* Own rows. */
static double element_mass(const struct species *s, enum column element)
{
    const double *mass = species_column(s, element);
    double sum = 0;
    for (int64_t i = s->own; i < s->own + s->n_own; i++) sum += mass[i];
    return sum;
}

/* Rates are the means since the row before. */
static void budget(struct sim *sim, void *state, struct energy_sink *sink)
{
    struct feedback *feedback = state;
    const double one = comm_rank() == 0, now = timeline_now(&sim->time), span = (now - feedback->at) * feedback->years;
    char name[48];
    for (int c = 0; c < told_causes(feedback); c++) {
        double rate = span > 0 ? (feedback->events[c] - feedback->told[c]) / span : 0;
        const bool wind = c == POPULATION_WIND;     /* years over years: so many stars have one */
        snprintf(name, sizeof name, "%s%s", population_cause_names[c], wind ? "_stars [1]" : "_rate [yr^-1]");
        sink->add(sink, name, one * rate);
        snprintf(name, sizeof name, "%s [%s]", population_cause_names[c], wind ? "yr" : "1");
        sink->add(sink, name, one * feedback->events[c]);
        snprintf(name, sizeof name, "returned_%s [Msun]", population_cause_names[c]);
        sink->add(sink, name, one * feedback->returned[c] * feedback->suns);
        feedback->told[c] = feedback->events[c];
    }
    feedback->at = now;
    for (int e = 0; e < N_ELEMENTS; e++) {
        if (!feedback->follows[e]) continue;
        snprintf(name, sizeof name, "%s_gas [Msun]", element_names[e]);
        sink->add(sink, name, element_mass(&sim->species[GAS], element_column(e)) * feedback->suns);
        snprintf(name, sizeof name, "%s_star [Msun]", element_names[e]);
        sink->add(sink, name, element_mass(&sim->species[STAR], element_column(e)) * feedback->suns);
        snprintf(name, sizeof name, "%s_cloud [Msun]", element_names[e]);
        if (sim->species[CLOUD].metals)
            sink->add(sink, name, element_mass(&sim->species[CLOUD], element_column(e)) * feedback->suns);
        snprintf(name, sizeof name, "%s_made [Msun]", element_names[e]);
        sink->add(sink, name, one * feedback->made[e] * feedback->suns);
    }
}

/* Rows in the shell that a supernova's hot bubble sweeps up before it cools: from so many on its momentum is right within a
 * third, below so few less than half of it is left (doc/charts/supernova.csv). */
static const double enough_rows = 400, too_few_rows = 25;

static void warn(struct sim *sim, void *state)
{
    const struct feedback *feedback = state;
    const struct species *gas = &sim->species[GAS];
    const double n_h = 1, thinnest = 1e-3;      /* of a galaxy's disc; of gas between the stars [cm^-3] */
    double mass = 0;
    if (feedback->time_step >= 1)
        log_warning("feedback.time_step: %g: a step can be longer than the lives of massive stars, whose supernovae all heat the "
                    "gas at its end", feedback->time_step);
    for (int64_t i = 0; i < gas->n; i++) mass += gas->mass[i] * sim->units.mass / CONST_M_SUN / (double)gas->n;
    if (!(mass > 0) || !sim_state(sim, "cooling") || !(feedback->efficiency > 0)) return;
    const double rows = supernova_shell_mass(n_h) / mass;
    if (feedback->efficiency < 1 && rows > enough_rows)
        log_warning("feedback.efficiency = %g: gas rows of %.3g Msun resolve supernovae, for which 1 is due",
                    feedback->efficiency, mass);
    if (feedback->form != DEPOSIT_HEAT) return;
    if (rows < too_few_rows)
        log_warning("feedback.variant: thermal: gas rows of %.3g Msun radiate the heat of a supernova before it expands where "
                    "n_H is above %.2g cm^-3 (tephra chart supernova): stochastic, momentum or lighter rows keep it", mass,
                    fmax(supernova_resolved(mass, too_few_rows), thinnest));
    else if (rows < enough_rows)
        log_warning("feedback.variant: thermal: gas rows of %.3g Msun give a supernova up to twice its momentum where n_H is "
                    "above %.2g cm^-3 (tephra chart supernova)", mass, supernova_resolved(mass, enough_rows));
}

const struct module feedback_module = {
    .name = "feedback", .whole = true, .doc = "stars return mass, elements and energy to the gas", .kind = MODULE_BLOCK,
    .params = params, .requires = requires, .state_bytes = sizeof(struct feedback), .saved = saved,
    .declare = declare, .begin = begin, .end = end, .energy = energy, .budget = budget, .reason = reason,
    .warn = warn, .hook = {[HOOK_EVENT] = event, [HOOK_LIMIT] = limit},
};
