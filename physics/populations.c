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

/* What is integrated over the stars that have ended. Two columns of wind yields: Z = 0.004, 0.02. */
enum channel {
    SNII_NUMBER, SNII_MASS, SNII_O, SNII_FE, SNIA_NUMBER, AGB_NUMBER,
    AGB_MASS, AGB_MASS_2, AGB_METALS, AGB_METALS_2, AGB_O, AGB_O_2, AGB_BURNT, AGB_BURNT_2,
    DEAD, LEFT, LEFT_2, N_CHANNELS
};

enum { MAX_CELLS = 256, POINTS = 16, WIND_POINTS = 48 };
static const double widest = 0.05;              /* cell in ln m */
static const double snii_from = 8, snii_to = 40;/* Msun; heavier ones collapse without return */

struct population {
    struct population_options options;
    int n;                                      /* cells */
    double log_m[MAX_CELLS + 1];                /* their ends, ln Msun, ascending */
    double sum[MAX_CELLS + 1][N_CHANNELS];      /* above this end */
    double low[MAX_CELLS][N_CHANNELS], high[MAX_CELLS][N_CHANNELS];   /* integrand per ln m at a cell's ends */
    gsl_integration_glfixed_table *rule;        /* of the winds of massive stars */
    double fastest;
};

struct population_options population_defaults(void)
{
    return (struct population_options){IMF_KROUPA_1993, POPULATION_BINARY, 0.05, 1.3e-3, 0.143, 0.743, 0};
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

/* --- yields --- */

/* van den Hoek & Groenewegen 1997: mass of the remnant [Msun]; newly made C, N and O less what was
 * turned into others, as fractions of the initial mass. */
struct wind { double remnant, c, n, o; };
enum { WIND_MASSES = 11 };
static const double wind_mass[WIND_MASSES] = {1, 1.3, 1.5, 1.7, 2, 2.5, 3, 4, 5, 7, 8};
static const double wind_metals[2] = {0.004, 0.02};
static const struct wind wind_table[2][WIND_MASSES] = {
    {{0.57, 6.9e-4, 1.2e-4, 6.4e-5}, {0.64, 1.7e-3, 1.6e-4, 1.4e-4}, {0.57, 2.2e-3, 2.0e-4, 2.1e-4},
     {0.58, 3.5e-3, 2.2e-4, 3.1e-4}, {0.62, 4.9e-3, 3.4e-4, 3.6e-4}, {0.64, 5.9e-3, 4.2e-4, 4.0e-4},
     {0.66, 7.4e-3, 4.4e-4, 5.1e-4}, {0.91, 1.1e-3, 4.5e-3, 2.8e-4}, {0.98, 3.8e-4, 6.4e-3, 2.6e-4},
     {1.12, 5.1e-4, 8.6e-3, -2.5e-4}, {1.19, 4.6e-4, 9.4e-3, -3.2e-4}},
    {{0.47, -7.5e-5, 7.7e-4, 9.8e-4}, {0.58, -4.5e-4, 8.7e-4, 4.2e-4}, {0.53, 8.6e-4, 9.9e-4, 3.7e-4},
     {0.56, 1.3e-3, 1.0e-3, 1.8e-4}, {0.60, 2.4e-3, 1.3e-3, 7.8e-5}, {0.60, 4.1e-3, 1.5e-3, -4.2e-5},
     {0.62, 5.2e-3, 1.7e-3, -1.5e-6}, {0.79, 4.7e-3, 1.8e-3, -2.2e-4}, {0.92, -6.0e-4, 7.3e-3, -2.9e-4},
     {1.07, -6.2e-4, 9.8e-3, -1.3e-3}, {1.15, -7.5e-4, 1.1e-2, -1.6e-3}}};

/* Linear in mass; stars below 1 Msun leave what one of 1 Msun does, and no more than they are. */
static struct wind wind_of(const struct wind table[WIND_MASSES], double m)
{
    int k = 0;
    if (m <= wind_mass[0]) {
        struct wind first = table[0];
        first.remnant = fmin(first.remnant, m);
        return first;
    }
    while (k < WIND_MASSES - 2 && m > wind_mass[k + 1]) k++;
    double x = (m - wind_mass[k]) / (wind_mass[k + 1] - wind_mass[k]), y = 1 - x;
    const struct wind *a = &table[k], *b = a + 1;
    return (struct wind){y * a->remnant + x * b->remnant, y * a->c + x * b->c, y * a->n + x * b->n,
                         y * a->o + x * b->o};
}

/* Oxygen burnt is a part of the oxygen of birth: counted as the mass of birth composition that held it. */
static const double oxygen_of_metals = 0.5;     /* Anders & Grevesse 1989, the composition of these models */

/* Each star of a cell that ends as a wind and a white dwarf. */
static void wind_yield(double m, double yield[N_CHANNELS])
{
    yield[AGB_NUMBER] = 1;
    for (int z = 0; z < 2; z++) {
        struct wind wind = wind_of(wind_table[z], m);
        yield[AGB_MASS + z] = m - wind.remnant;
        yield[AGB_METALS + z] = m * (wind.c + wind.n + wind.o);
        yield[AGB_O + z] = m * fmax(wind.o, 0);
        yield[AGB_BURNT + z] = m * fmax(-wind.o, 0) / (oxygen_of_metals * wind_metals[z]);
        yield[LEFT + z] = wind.remnant;
    }
}

/* Fits of Raiteri, Villata & Navarro 1996 to Woosley & Weaver 1995, for 8 to 40 Msun. */
static double snii_ejecta(double m) { return 0.7682 * pow(m, 1.056); }

static void snii_yield(double m, double yield[N_CHANNELS])
{
    yield[SNII_NUMBER] = 1;
    yield[SNII_MASS] = snii_ejecta(m);
    yield[SNII_FE] = 2.802e-4 * pow(m, 1.864);
    yield[SNII_O] = 4.586e-4 * pow(m, 2.721);
    yield[LEFT] = yield[LEFT_2] = m - yield[SNII_MASS];
}

static const double o_to_metals = 2.09, fe_to_metals = 1.06;   /* metals of SNII: solar ratios (Asplund et al. 2009) */
static const double snia_mass = 1.4;            /* ejecta, Msun */

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

/* Everything per ln m at a mass, for a cell about `middle`, which decides how its stars end. */
static void integrand(const struct population_options *options, double m, double middle, double value[N_CHANNELS])
{
    double number = m * imf_density(options->imf, m);
    for (int c = 0; c < N_CHANNELS; c++) value[c] = 0;
    value[DEAD] = value[LEFT] = value[LEFT_2] = m;
    if (middle < snii_from) wind_yield(m, value);
    else if (middle < snii_to) snii_yield(m, value);
    for (int c = 0; c < N_CHANNELS; c++) value[c] *= number;
    value[SNIA_NUMBER] = m * snia_binaries(options, m);
    value[LEFT] -= snia_mass * value[SNIA_NUMBER];
    value[LEFT_2] -= snia_mass * value[SNIA_NUMBER];
}

/* Cell ends at every mass where something is not smooth, none wider than `widest`. */
static void make_cells(struct population *population)
{
    static const double breaks[] = {IMF_LOWEST, 0.47, 0.5, 0.57, 1, 1.3, 1.5, 1.7, 2, 2.5, 3, 4, 5, 7, 8, 40,
                                    IMF_HIGHEST};
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
    const struct population_options *options = &population->options;
    double from = population->log_m[cell], to = population->log_m[cell + 1], middle = exp(0.5 * (from + to));
    double *sum = population->sum[cell], value[N_CHANNELS], log_m, weight;
    integrand(options, exp(from), middle, population->low[cell]);
    integrand(options, exp(to), middle, population->high[cell]);
    for (int c = 0; c < N_CHANNELS; c++) sum[c] = population->sum[cell + 1][c];
    for (size_t p = 0; p < POINTS; p++) {
        gsl_integration_glfixed_point(from, to, p, &log_m, &weight, rule);
        integrand(options, exp(log_m), middle, value);
        for (int c = 0; c < N_CHANNELS; c++) sum[c] += weight * value[c];
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
            population_returned(population, age, &(struct population_birth){metals[z], 0, 0}, by_cause);
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
    make_cells(population);
    for (int cell = population->n - 1; cell >= 0; cell--) integrate_cell(population, cell, rule);
    gsl_integration_glfixed_table_free(rule);
    population->rule = gsl_integration_glfixed_table_alloc(WIND_POINTS);
    population->fastest = find_fastest(population);
    return population;
}

void population_free(struct population *population)
{
    if (population) gsl_integration_glfixed_table_free(population->rule);
    mem_free(population);
}

/* The sums over all stars above a mass: Hermite's cubic in ln m. */
static void sum_above(const struct population *population, double m, double sum[N_CHANNELS])
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
    const double *a = population->sum[low], *b = population->sum[low + 1];
    for (int c = 0; c < N_CHANNELS; c++)
        sum[c] = a[c] + step * (b[c] - a[c]) - rise_a * population->low[low][c] - rise_b * population->high[low][c];
}

/* Where between the two columns of winds a metallicity stands: linear in log Z. */
static double wind_place(double metals)
{
    if (metals <= wind_metals[0]) return 0;
    return fmin(1, log(metals / wind_metals[0]) / log(wind_metals[1] / wind_metals[0]));
}

static double mix(const double *column, double place) { return column[0] + place * (column[1] - column[0]); }

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
    const double turnoff = fmin(fmax(population_turnoff(age, metals), snii_from), snii_to), half = 0.5;
    const double end[3] = {log(snii_from), log(turnoff), log(snii_to)};
    struct massive sum = {0};
    for (int dead = 0; dead < 2; dead++)
        for (size_t p = 0; p < WIND_POINTS && end[dead] < end[dead + 1]; p++) {
            double log_m, weight;
            gsl_integration_glfixed_point(end[dead], end[dead + 1], p, &log_m, &weight, population->rule);
            double m = exp(log_m), number = weight * m * imf_density(population->options.imf, m);
            double years = dead ? population_lifetime(m, metals) : age;
            double lost = fmin(population->options.wind_loss * years, half * snii_ejecta(m));
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
    struct massive massive = find_massive(population, age, birth->metals);
    by_cause[POPULATION_WIND] = (struct population_return){massive.years, massive.lost, birth->metals * massive.lost,
                                                           birth->o * massive.lost, birth->fe * massive.lost};
    snii->mass -= massive.lost_by_dead;
    snii->metals -= birth->metals * massive.lost_by_dead;
    snii->o -= birth->o * massive.lost_by_dead;
    snii->fe -= birth->fe * massive.lost_by_dead;
}

void population_returned(const struct population *population, double age, const struct population_birth *birth,
                         struct population_return by_cause[N_POPULATION_CAUSES])
{
    const struct population_options *options = &population->options;
    double sum[N_CHANNELS], place = wind_place(birth->metals);
    sum_above(population, population_turnoff(age, birth->metals), sum);
    double o = sum[SNII_O], fe = sum[SNII_FE];
    by_cause[POPULATION_SNII] = (struct population_return){sum[SNII_NUMBER], sum[SNII_MASS],
                                                           o_to_metals * o + fe_to_metals * fe, o, fe};
    double snia = fmax(sum[SNIA_NUMBER], 0) + delayed(options, age);    /* rounding, before the first of them */
    by_cause[POPULATION_SNIA] = (struct population_return){snia, snia_mass * snia, snia_mass * snia,
                                                           options->snia_o * snia, options->snia_fe * snia};
    double mass = mix(&sum[AGB_MASS], place), made = mix(&sum[AGB_METALS], place);
    double old_o = birth->o * (mass - mix(&sum[AGB_BURNT], place)), new_o = mix(&sum[AGB_O], place);
    by_cause[POPULATION_AGB] = (struct population_return){sum[AGB_NUMBER], mass, birth->metals * mass + made,
                                                          old_o + new_o, birth->fe * mass};
    by_cause[POPULATION_WIND] = (struct population_return){0};
    add_winds(population, age, birth, by_cause);
}

double population_dead(const struct population *population, double age, double metals)
{
    double sum[N_CHANNELS];
    sum_above(population, population_turnoff(age, metals), sum);
    return sum[DEAD];
}

double population_remnants(const struct population *population, double age, double metals)
{
    double sum[N_CHANNELS];
    sum_above(population, population_turnoff(age, metals), sum);
    return mix(&sum[LEFT], wind_place(metals)) - snia_mass * delayed(&population->options, age);
}
