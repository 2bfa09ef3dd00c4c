/* SPDX-License-Identifier: GPL-3.0-or-later
 * A stellar population of one age and composition: what it has returned when it is so old. Everything
 * is cumulative in age, so that what is due between two ages is a difference and no step, however long,
 * misses anything. Masses in Msun and numbers per Msun of stars formed, ages in years
 * (doc/manual/populations.md). */
#ifndef TEPHRA_POPULATIONS_H
#define TEPHRA_POPULATIONS_H
#include "imf.h"
#include "yields.h"
#include <stdbool.h>

/* By what stars return their mass. */
enum population_cause { POPULATION_SNII, POPULATION_SNIA, POPULATION_AGB, POPULATION_WIND, N_POPULATION_CAUSES };
extern const char *const population_cause_names[N_POPULATION_CAUSES];

/* In the order of POPULATION_SNIA_CHOICES. */
enum population_snia {
    POPULATION_BINARY,      /* Greggio & Renzini 1983 as in Raiteri, Villata & Navarro 1996 */
    POPULATION_DELAY,       /* t^-1.12 from 40 Myr: Maoz, Mannucci & Brandt 2012 */
    POPULATION_NO_SNIA
};
#define POPULATION_SNIA_CHOICES "binary|delay|none"

/* In the order of POPULATION_SNII_CHOICES. */
enum population_snii {
    POPULATION_RAITERI,     /* fits of Raiteri, Villata & Navarro 1996; metals, oxygen and iron alone */
    POPULATION_PORTINARI    /* Portinari, Chiosi & Bressan 1998, winds included; all elements */
};
#define POPULATION_SNII_CHOICES "raiteri1996|portinari1998"

struct population_options {
    enum imf_kind imf;
    enum population_snii snii;
    enum population_snia snia;
    double binaries;        /* A_B: part of the stars of 3 to 16 Msun in total that are binaries which explode */
    double snia_number;     /* delay: supernovae per Msun formed within 13.8 Gyr */
    double snia_o, snia_fe; /* Msun of oxygen and of iron from each SNIa */
    double wind_loss;       /* Msun a year that each star which becomes an SNII loses before; 0: no winds */
    bool follows[N_ELEMENTS];   /* which elements returns are asked of; metals always */
};
/* Kroupa 1993, Raiteri's fits, 0.05 binaries or 1.3e-3 per Msun; 0.143 and 0.743 Msun (W7, Iwamoto et al. 1999); no winds; metals,
 * oxygen and iron. */
struct population_options population_defaults(void);

/* Mass fractions of the gas from which the stars formed. */
struct population_birth { double element[N_ELEMENTS]; };
/* number: of events; of winds: years that stars have had one, all together. Elements that are not followed: 0. */
struct population_return { double number, mass, element[N_ELEMENTS]; };

struct population;
struct population *population_new(const struct population_options *options);
void population_free(struct population *population);

/* What stars of this composition have returned at an age, by cause. mass counts all that left the
 * stars, element what of it is each element, the stars' own share included. */
void population_returned(const struct population *population, double age, const struct population_birth *birth,
                         struct population_return by_cause[N_POPULATION_CAUSES]);
/* More than the mass that is ever returned while the age grows by a factor e. */
double population_fastest(const struct population *population);
/* Mass of the stars that have ended, and of what is left of them: dead = returned + remnants. */
double population_dead(const struct population *population, double age, double metals);
double population_remnants(const struct population *population, double age, double metals);

/* Life of a star of m Msun [yr], and the mass of the stars that end at an age, at most IMF_HIGHEST
 * (Raiteri, Villata & Navarro 1996, eq. 3; metallicities are clipped to 7e-5 ... 0.03). */
double population_lifetime(double m, double metals);
double population_turnoff(double age, double metals);
#endif
