/* SPDX-License-Identifier: GPL-3.0-or-later
 * Constants in cgs: CODATA 2018; GM_sun and the astronomical unit from the IAU (2015 B3, 2012 B2).
 * The solar mass follows from GM_sun, so that G M_sun is exact. */
#ifndef TEPHRA_CONSTANTS_H
#define TEPHRA_CONSTANTS_H
#define CONST_G          6.67430e-8             /* cm^3 g^-1 s^-2 */
#define CONST_GM_SUN     1.3271244e26           /* cm^3 s^-2 */
#define CONST_M_SUN      (CONST_GM_SUN / CONST_G) /* g: 1.98841e33 */
#define CONST_AU         1.495978707e13         /* cm */
#define CONST_PC         3.0856775814913673e18  /* cm: 648000/pi au */
#define CONST_YEAR       3.15576e7              /* s: Julian */
#define CONST_K_B        1.380649e-16           /* erg/K */
#define CONST_M_PROTON   1.67262192369e-24      /* g */
#define CONST_HYDROGEN   0.76                   /* mass fraction of primordial gas: n_H is told by it where nothing says another */
#define CONST_TEXT(...)  CONST_QUOTED(__VA_ARGS__)  /* for the default of a parameter */
#define CONST_QUOTED(...) #__VA_ARGS__
#endif
