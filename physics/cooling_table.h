/* SPDX-License-Identifier: GPL-3.0-or-later
 * What is known of cooling as functions of temperature: tables by metallicity, read from files
 * (layout: cooling_tables/sutherland_dopita_1993.txt), and fits. All of it becomes a list of samples
 * from which cooling_curve.h makes what is integrated. Everything in cgs. */
#ifndef TEPHRA_COOLING_TABLE_H
#define TEPHRA_COOLING_TABLE_H
#include "fail.h"

/* Loss per volume is n_H^2 loss. */
struct cooling_sample {
    double t, loss;             /* temperature [K], loss [erg cm^3/s] */
    double particle, hydrogen;  /* mean mass of a particle, mass of the gas per hydrogen nucleus [g] */
};
enum { COOLING_SAMPLES = 1024 };
struct cooling_samples { int n; struct cooling_sample at[COOLING_SAMPLES]; };  /* ascending in t */

struct cooling_table {
    int n_t, n_z;
    double *log_t;              /* log10 T, ascending */
    double *feh, *hydrogen;     /* [Fe/H], ascending; mass per hydrogen nucleus [g] */
    double *log_l, *particle;   /* [z * n_t + t]: log10 loss; mass of a particle [g] */
};

/* [Fe/H] of a metal mass fraction, log10(Z / 0.02), with the zero of metals at -5. */
double cooling_table_feh(double metallicity);

/* Reads a file. What is wrong with it goes to `problems`; then NULL. */
struct cooling_table *cooling_table_read(const char *path, struct problems *problems);
void cooling_table_free(struct cooling_table *table);

/* The table at a metallicity, log L and the masses linear in [Fe/H], beyond its ends constant; above
 * its last temperature continued with T^(1/2) (free-free) to 1e10 K. */
void cooling_table_sample(const struct cooling_table *table, double feh, struct cooling_samples *samples);
/* The same, continued below with cooling_table_dalgarno from 10 K to where the two meet above 1e4 K,
 * or to the table's first temperature if they do not. */
void cooling_table_sample_low(const struct cooling_table *table, double feh, struct cooling_samples *samples);
/* cooling_table_koyama from 10 K to 10^4.1 K, blended with the table up to 10^4.2 K, the table above. */
void cooling_table_sample_koyama(const struct cooling_table *table, double feh, struct cooling_samples *samples);

/* Dalgarno & McCray 1972 at an ionisation of 0.1 as the power laws of Rosen & Bregman 1995, valid
 * below 2.5e4 K [erg cm^3/s]. What metals contribute below 8000 K is proportional to them; `metals`
 * is 1 for solar abundance. */
double cooling_table_dalgarno(double t, double metals);
/* Koyama & Inutsuka 2002, eq. 4 with the constant 1.4e-2 (Vazquez-Semadeni et al. 2007); solar, valid
 * below 1.6e4 K [erg cm^3/s]. Its heating is COOLING_KOYAMA_HEATING per hydrogen nucleus. */
double cooling_table_koyama(double t);
#define COOLING_KOYAMA_HEATING 2.0e-26          /* erg/s: Koyama & Inutsuka 2002, eq. 4 */
#endif
