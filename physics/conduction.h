/* SPDX-License-Identifier: GPL-3.0-or-later
 * Condensation on clouds and evaporation of them in hot gas, by conduction (doc/manual/exchange.md, section 2). Masses
 * in Msun, times in years, temperatures in K, particle densities in cm^-3, radii in pc. */
#ifndef TEPHRA_CONDUCTION_H
#define TEPHRA_CONDUCTION_H
#include <stdbool.h>

struct conduction {
    double radius, power;       /* of a cloud: radius (m/1e6)^power */
    double part;                /* of the conductivity that magnetic fields leave, Phi */
    bool sharp;                 /* the two branches meet at sigma_0 = 0.03 with a jump, not over 0.3 dex to each side */
};

/* A cloud and the gas about it, which fills a fixed volume. */
struct conduction_zones {
    double cloud, gas;          /* masses */
    double T, n;                /* of the gas */
    double T_cloud;             /* of what evaporates, times the gas' mean molecular weight over the cloud's */
};

/* sigma_0 = (T/1.54e7 K)^2/(Phi n h) of a cloud of mass m (Cowie & McKee 1977). */
double conduction_sigma(const struct conduction *law, double T, double n, double m);
/* dm/dt in Msun/yr, above 0 where gas condenses. */
double conduction_rate(const struct conduction *law, double T, double n, double m);
/* Mass after a time in gas that does not change: closed forms, but for the blend of the branches; 0 once it has gone. */
double conduction_advance(const struct conduction *law, double T, double n, double m, double time);
/* The same where the gas cools by what evaporates and thins by what condenses: in parts in which neither the cloud's nor
 * the gas' mass changes by more than some per cent. */
void conduction_zones(const struct conduction *law, struct conduction_zones *zones, double time);
#endif
