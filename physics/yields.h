/* SPDX-License-Identifier: GPL-3.0-or-later
 * What one star returns when it ends, element by element, as published (doc/manual/populations.md, section 3). Of each element
 * that is birth (mass - burnt) + made, with birth the mass fraction of the gas from which the star formed: what was turned into
 * others, or is locked up, is a part of what the star was born with. */
#ifndef TEPHRA_YIELDS_H
#define TEPHRA_YIELDS_H

/* In the order of the columns of src/columns.h. Metals: all elements beyond helium together. */
enum element {
    ELEMENT_METALS, ELEMENT_O, ELEMENT_FE, ELEMENT_C, ELEMENT_N, ELEMENT_NE, ELEMENT_MG, ELEMENT_SI, ELEMENT_S, ELEMENT_CA,
    N_ELEMENTS
};
/* Symbols as scenes have them and names as files have them; those of ELEMENT_METALS are "Z" and "metals". */
extern const char *const element_symbols[N_ELEMENTS], *const element_names[N_ELEMENTS];
/* Of the sun's metals (Asplund, Grevesse, Sauval & Scott 2009). */
extern const double element_solar[N_ELEMENTS];

/* Msun; burnt: mass of birth composition whose share of the element is gone. mass + left = m. */
struct yield { double mass, left, made[N_ELEMENTS], burnt[N_ELEMENTS]; };

/* One table: columns of metallicity, ascending, and what a star of m Msun, from `from` to `to`, returns in one of them. */
enum { YIELD_COLUMNS = 5 };
struct yield_table {
    int columns;
    double metals[YIELD_COLUMNS], from, to;
    void (*of)(int column, double m, struct yield *yield);
};
extern const struct yield_table yields_groenewegen1997, yields_raiteri1996, yields_portinari1998;

/* Where a metallicity stands: between *column and the next one, `place` of the way, linear in log Z; constant beyond the ends. */
double yields_place(const struct yield_table *table, double metals, int *column);

/* What is ejected by a supernova II of m Msun (Raiteri, Villata & Navarro 1996). */
double yields_snii_ejecta(double m);
/* Of one supernova Ia, Msun: W7 (Iwamoto et al. 1999). */
extern const double yields_snia[N_ELEMENTS];
#endif
