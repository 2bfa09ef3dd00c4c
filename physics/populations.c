/* SPDX-License-Identifier: GPL-3.0-or-later
 * Tables of what stars above a mass return, as functions of that mass, made once for an initial mass
 * function; age and metallicity come in through the mass of the stars that end then. Between nodes the
 * tables are cubic, with the integrands as slopes; sums that hold at the nodes hold everywhere. */
#include "populations.h"
#include "fail.h"
#include "mem.h"
#include <gsl/gsl_integration.h>
#include <math.h>
#include <stddef.h>

const char *const population_cause_names[N_POPULATION_CAUSES] = {"snii", "snia", "agb", "wind"};

/* What is integrated over the stars that have ended: numbers and masses, and then, for each column of metallicity of the winds'
 * table and of the supernovae's, mass, remnants and what is made and burnt of each element that is followed. */
enum channel { SNII_NUMBER, SNIA_NUMBER, AGB_NUMBER, DEAD, COLLAPSED, FIRST_YIELD };
enum { WIDEST_YIELD = 2 + 2 * N_ELEMENTS, MAX_CHANNELS = FIRST_YIELD + (2 + YIELD_COLUMNS) * WIDEST_YIELD };
enum yield_part { YIELD_MASS, YIELD_LEFT, YIELD_MADE };     /* and from YIELD_MADE + n_elements on what is burnt */

enum { MAX_CELLS = 256, POINTS = 16, WIND_POINTS = 48 };
static const double widest = 0.05;              /* cell in ln m */
static const struct yield_table *const agb_table = &yields_groenewegen1997;
static const struct yield_table *const snii_tables[] = {&yields_raiteri1996, &yields_portinari1998};

struct population {
    struct population_options options;
    int n_elements;
    enum element element[N_ELEMENTS];           /* those that are followed, metals first */
    const struct yield_table *snii;
    int n, channels;                            /* cells; channels in use */
    double log_m[MAX_CELLS + 1];                /* their ends, ln Msun, ascending */
    double *sum;                                /* above each end: `channels` numbers each */
    double *low, *high;                         /* integrand per ln m at a cell's ends, likewise */
    gsl_integration_glfixed_table *rule;        /* of the winds of massive stars */
    double fastest;
};

struct population_options population_defaults(void)
{
    return (struct population_options){
        .imf = IMF_KROUPA_1993, .snii = POPULATION_RAITERI, .snia = POPULATION_BINARY, .binaries = 0.05, .snia_number = 1.3e-3,
        .snia_o = yields_snia[ELEMENT_O], .snia_fe = yields_snia[ELEMENT_FE],
        .follows = {[ELEMENT_METALS] = true, [ELEMENT_O] = true, [ELEMENT_FE] = true}};
}

/* --- lives --- */

/* log10 t = a[0] + a[1] log10 m + a[2] (log10 m)^2. */
static void life_terms(double metals, double a[3])
{
    double z = log10(fmin(fmax(metals, 7e-5), 0.03));
    a[0] = 10.13 + 0.07547 * z - 0.008084 * z * z;
    a[1] = -4.424 - 0.7939 * z - 0.1187 * z * z;
    a[2] = 1.262 + 0.3385 * z + 0.05417 * z * z;
}

double population_lifetime(double m, double metals)
{
    double a[3], x = log10(m);
    life_terms(metals, a);
    return pow(10, a[0] + x * (a[1] + x * a[2]));
}

double population_turnoff(double age, double metals)
{
    double a[3];
    if (!(age > 0)) return IMF_HIGHEST;
    life_terms(metals, a);
    double root = a[1] * a[1] - 4 * a[2] * (a[0] - log10(age));
    if (root < 0) return IMF_HIGHEST;           /* before the shortest life */
    return fmin(fmax(pow(10, (-a[1] - sqrt(root)) / (2 * a[2])), IMF_LOWEST), IMF_HIGHEST);
}

/* --- supernovae Ia --- */

static const double snia_mass = 1.4;            /* ejecta, Msun: all of them metals */

/* Binaries whose secondary has mass m per Msun of m: 24 (m/M)^2 phi(M)/M over total masses M of 3 to
 * 16 Msun with a primary of at most 8 (Greggio & Renzini 1983). */
static double snia_binaries(const struct population_options *options, double m)
{
    const double total_from = fmax(2 * m, 3), total_to = fmin(m + 8, 16);
    double sum = 0, total, weight;
    if (options->snia != POPULATION_BINARY || total_to <= total_from) return 0;
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(POINTS);
    for (size_t p = 0; p < POINTS; p++) {
        gsl_integration_glfixed_point(total_from, total_to, p, &total, &weight, rule);
        sum += weight * 24 * (m / total) * (m / total) * imf_density(options->imf, total) / total;
    }
    gsl_integration_glfixed_table_free(rule);
    return options->binaries * sum;
}

/* --- tables --- */

/* First channel of a column. */
static int yield_channel(const struct population *population, const struct yield_table *table, int column)
{
    const int width = 2 + 2 * population->n_elements, before = table == agb_table ? 0 : agb_table->columns;
    return FIRST_YIELD + (before + column) * width;
}

static double *channels_of(const struct population *population, double *table, int cell)
{
    return table + (size_t)cell * (size_t)population->channels;
}

static void add_yields(const struct population *population, const struct yield_table *table, double m, double value[MAX_CHANNELS])
{
    struct yield yield;
    for (int column = 0; column < table->columns; column++) {
        double *to = value + yield_channel(population, table, column);
        table->of(column, m, &yield);
        to[YIELD_MASS] = yield.mass;
        to[YIELD_LEFT] = yield.left;
        for (int e = 0; e < population->n_elements; e++) {
            to[YIELD_MADE + e] = yield.made[population->element[e]];
            to[YIELD_MADE + population->n_elements + e] = yield.burnt[population->element[e]];
        }
    }
}

/* Everything per ln m at a mass, for a cell about `middle`, which decides how its stars end. */
static void integrand(const struct population *population, double m, double middle, double value[MAX_CHANNELS])
{
    const struct population_options *options = &population->options;
    const double number = m * imf_density(options->imf, m);
    for (int c = 0; c < population->channels; c++) value[c] = 0;
    value[DEAD] = m;
    if (middle < agb_table->to) {
        value[AGB_NUMBER] = 1;
        add_yields(population, agb_table, m, value);
    } else if (middle < population->snii->to) {
        value[SNII_NUMBER] = 1;
        add_yields(population, population->snii, m, value);
    } else {
        value[COLLAPSED] = m;
    }
    for (int c = 0; c < population->channels; c++) value[c] *= number;
    value[SNIA_NUMBER] = m * snia_binaries(options, m);
}

/* Cell ends at every mass where something is not smooth, none wider than `widest`. */
static void make_cells(struct population *population)
{
    static const double breaks[] = {IMF_LOWEST, 0.47, 0.5, 0.57, 1, 1.3, 1.5, 1.7, 2, 2.5, 3, 4, 5, 7, 8, 9,
                                    12, 15, 20, 30, 40, 60, IMF_HIGHEST};
    population->log_m[0] = log(breaks[0]);
    for (size_t b = 1; b < sizeof breaks / sizeof *breaks; b++) {
        double from = log(breaks[b - 1]), to = log(breaks[b]);
        int pieces = (int)ceil((to - from) / widest);
        check(population->n + pieces <= MAX_CELLS);
        for (int k = 1; k <= pieces; k++) population->log_m[++population->n] = from + (to - from) * k / pieces;
    }
}

static void integrate_cell(struct population *population, int cell, gsl_integration_glfixed_table *rule)
{
    double from = population->log_m[cell], to = population->log_m[cell + 1], middle = exp(0.5 * (from + to));
    double *sum = channels_of(population, population->sum, cell), *above = sum + population->channels;
    double value[MAX_CHANNELS], log_m, weight;
    integrand(population, exp(from), middle, channels_of(population, population->low, cell));
    integrand(population, exp(to), middle, channels_of(population, population->high, cell));
    for (int c = 0; c < population->channels; c++) sum[c] = above[c];
    for (size_t p = 0; p < POINTS; p++) {
        gsl_integration_glfixed_point(from, to, p, &log_m, &weight, rule);
        integrand(population, exp(log_m), middle, value);
        for (int c = 0; c < population->channels; c++) sum[c] += weight * value[c];
    }
}

/* Sampled at ages far closer than returns change, for metallicities as far as they matter. */
static double find_fastest(const struct population *population)
{
    static const double metals[] = {0, 0.004, 0.02, 0.03};
    const double from = 1e5, to = 3e10, factor = 1.02, safety = 1.5;
    double most = 0;
    for (int z = 0; z < 4; z++) {
        double before = 0;
        for (double age = from; age < to; age *= factor) {
            struct population_return by_cause[N_POPULATION_CAUSES];
            double sum = 0;
            population_returned(population, age, &(struct population_birth){{metals[z]}}, by_cause);
            for (int c = 0; c < N_POPULATION_CAUSES; c++) sum += by_cause[c].mass;
            most = fmax(most, (sum - before) / log(factor));
            before = sum;
        }
    }
    return safety * most;
}

double population_fastest(const struct population *population) { return population->fastest; }

struct population *population_new(const struct population_options *options)
{
    struct population *population = mem_alloc("populations", sizeof *population);
    gsl_integration_glfixed_table *rule = gsl_integration_glfixed_table_alloc(POINTS);
    population->options = *options;
    population->snii = snii_tables[options->snii];
    for (int e = 0; e < N_ELEMENTS; e++)
        if (e == ELEMENT_METALS || options->follows[e]) population->element[population->n_elements++] = (enum element)e;
    population->channels = yield_channel(population, population->snii, population->snii->columns);
    make_cells(population);
    population->sum = mem_array("populations", double, (population->n + 1) * population->channels);
    population->low = mem_array("populations", double, population->n * population->channels);
    population->high = mem_array("populations", double, population->n * population->channels);
    for (int cell = population->n - 1; cell >= 0; cell--) integrate_cell(population, cell, rule);
    gsl_integration_glfixed_table_free(rule);
    population->rule = gsl_integration_glfixed_table_alloc(WIND_POINTS);
    population->fastest = find_fastest(population);
    return population;
}

void population_free(struct population *population)
{
    if (!population) return;
    gsl_integration_glfixed_table_free(population->rule);
    mem_free(population->sum);
    mem_free(population->low);
    mem_free(population->high);
    mem_free(population);
}

/* The sums over all stars above a mass: Hermite's cubic in ln m. */
static void sum_above(const struct population *population, double m, double sum[MAX_CHANNELS])
{
    double log_m = fmin(fmax(log(m), population->log_m[0]), population->log_m[population->n]);
    int low = 0, high = population->n;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (population->log_m[middle] <= log_m) low = middle;
        else high = middle;
    }
    double width = population->log_m[low + 1] - population->log_m[low], x = (log_m - population->log_m[low]) / width;
    const double step = x * x * (3 - 2 * x), rise_a = x * (1 - x) * (1 - x) * width, rise_b = x * x * (x - 1) * width;
    const double *a = channels_of(population, population->sum, low), *b = a + population->channels;
    const double *begins = channels_of(population, population->low, low), *ends = channels_of(population, population->high, low);
    for (int c = 0; c < population->channels; c++)
        sum[c] = a[c] + step * (b[c] - a[c]) - rise_a * begins[c] - rise_b * ends[c];
}

/* Supernovae Ia up to an age by the law of delays; between t0 and a Hubble time there are snia_number. */
static double delayed(const struct population_options *options, double age)
{
    const double t0 = 40e6, t_hubble = 13.8e9, power = 1 - 1.12;
    if (options->snia != POPULATION_DELAY || age <= t0) return 0;
    return options->snia_number * (pow(age / t0, power) - 1) / (pow(t_hubble / t0, power) - 1);
}

/* Winds of the stars that become SNII, up to an age: for how long [yr], and mass in all and of what has exploded since.
 * None blows away more than half of what its supernova would eject, which is that much less. */
struct massive { double years, lost, lost_by_dead; };

static struct massive find_massive(const struct population *population, double age, double metals)
{
    const struct yield_table *table = population->snii;
    const double turnoff = fmin(fmax(population_turnoff(age, metals), table->from), table->to), half = 0.5;
    const double end[3] = {log(table->from), log(turnoff), log(table->to)};
    struct massive sum = {0};
    for (int dead = 0; dead < 2; dead++)
        for (size_t p = 0; p < WIND_POINTS && end[dead] < end[dead + 1]; p++) {
            double log_m, weight;
            gsl_integration_glfixed_point(end[dead], end[dead + 1], p, &log_m, &weight, population->rule);
            double m = exp(log_m), number = weight * m * imf_density(population->options.imf, m);
            double years = dead ? population_lifetime(m, metals) : age;
            double lost = fmin(population->options.wind_loss * years, half * yields_snii_ejecta(m));
            sum.years += number * years;
            sum.lost += number * lost;
            if (dead) sum.lost_by_dead += number * lost;
        }
    return sum;
}

/* The winds have the composition of birth; what is left for the supernovae is without it. */
static void add_winds(const struct population *population, double age, const struct population_birth *birth,
                      struct population_return by_cause[N_POPULATION_CAUSES])
{
    struct population_return *snii = &by_cause[POPULATION_SNII];
    if (!(population->options.wind_loss > 0) || !(age > 0)) return;
    struct massive massive = find_massive(population, age, birth->element[ELEMENT_METALS]);
    struct population_return *wind = &by_cause[POPULATION_WIND];
    wind->number = massive.years;
    wind->mass = massive.lost;
    snii->mass -= massive.lost_by_dead;
    for (int k = 0; k < population->n_elements; k++) {
        const enum element e = population->element[k];
        wind->element[e] = birth->element[e] * massive.lost;
        snii->element[e] -= birth->element[e] * massive.lost_by_dead;
    }
}

static double mix(const double *a, const double *b, int part, double place) { return a[part] + place * (b[part] - a[part]); }

/* Sums over the stars of a table, between its columns. */
static void add_ended(const struct population *population, const struct yield_table *table, const double sum[MAX_CHANNELS],
                      const struct population_birth *birth, struct population_return *returned)
{
    const int n = population->n_elements;
    int column;
    const double place = yields_place(table, birth->element[ELEMENT_METALS], &column);
    const double *a = sum + yield_channel(population, table, column);
    const double *b = place > 0 ? sum + yield_channel(population, table, column + 1) : a;
    returned->mass = mix(a, b, YIELD_MASS, place);
    for (int k = 0; k < n; k++) {
        const enum element e = population->element[k];
        const double burnt = mix(a, b, YIELD_MADE + n + k, place);
        returned->element[e] = birth->element[e] * (returned->mass - burnt) + mix(a, b, YIELD_MADE + k, place);
    }
}

static void add_snia(const struct population *population, double number, struct population_return *returned)
{
    returned->number = number;
    returned->mass = snia_mass * number;
    for (int k = 0; k < population->n_elements; k++) {
        const enum element e = population->element[k];
        double yield = e == ELEMENT_O ? population->options.snia_o : e == ELEMENT_FE ? population->options.snia_fe : yields_snia[e];
        returned->element[e] = yield * number;
    }
}

void population_returned(const struct population *population, double age, const struct population_birth *birth,
                         struct population_return by_cause[N_POPULATION_CAUSES])
{
    double sum[MAX_CHANNELS];
    sum_above(population, population_turnoff(age, birth->element[ELEMENT_METALS]), sum);
    for (int c = 0; c < N_POPULATION_CAUSES; c++) by_cause[c] = (struct population_return){0};
    by_cause[POPULATION_SNII].number = sum[SNII_NUMBER];
    by_cause[POPULATION_AGB].number = sum[AGB_NUMBER];
    add_ended(population, population->snii, sum, birth, &by_cause[POPULATION_SNII]);
    add_ended(population, agb_table, sum, birth, &by_cause[POPULATION_AGB]);
    double snia = fmax(sum[SNIA_NUMBER], 0) + delayed(&population->options, age);   /* rounding, before the first of them */
    add_snia(population, snia, &by_cause[POPULATION_SNIA]);
    add_winds(population, age, birth, by_cause);
}

double population_dead(const struct population *population, double age, double metals)
{
    double sum[MAX_CHANNELS];
    sum_above(population, population_turnoff(age, metals), sum);
    return sum[DEAD];
}

static double left_by(const struct population *population, const struct yield_table *table, const double sum[MAX_CHANNELS],
                      double metals)
{
    int column;
    const double place = yields_place(table, metals, &column), *a = sum + yield_channel(population, table, column);
    return place > 0 ? mix(a, sum + yield_channel(population, table, column + 1), YIELD_LEFT, place) : a[YIELD_LEFT];
}

double population_remnants(const struct population *population, double age, double metals)
{
    double sum[MAX_CHANNELS];
    sum_above(population, population_turnoff(age, metals), sum);
    double left = left_by(population, agb_table, sum, metals) + left_by(population, population->snii, sum, metals);
    return sum[COLLAPSED] + left - snia_mass * (fmax(sum[SNIA_NUMBER], 0) + delayed(&population->options, age));
}
