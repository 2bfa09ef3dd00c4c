/* SPDX-License-Identifier: GPL-3.0-or-later
 * A supernova of 1e51 erg in even gas of n_H [cm^-3] that cools (Kim & Ostriker 2015, ApJ 802, 99). The shell forms at
 * r = 22.6 pc n^-0.42 (eq. 8); Sedov's solution is there at the time, and has swept up the mass, below. The momentum is that of
 * supernovae in two-phase gas in the end (abstract and eq. 34); in even gas it is 1/0.95 of that (abstract). */
#ifndef TEPHRA_SUPERNOVA_H
#define TEPHRA_SUPERNOVA_H
#include <math.h>

/* When the shell forms [yr], the mass swept up by then [Msun], and the momentum in the end [Msun km/s]: of gas in two phases. */
static inline double supernova_shell_time(double n_h) { return 4.4e4 * pow(n_h, -0.55); }
static inline double supernova_shell_mass(double n_h) { return 1.68e3 * pow(n_h, -0.26); }
static inline double supernova_momentum(double n_h) { return 2.8e5 * pow(n_h, -0.17); }

/* The density up to which gas rows of that mass [Msun] are at most one of `rows` in the shell. */
static inline double supernova_resolved(double row, double rows) { return pow(1.68e3 / (rows * row), 1 / 0.26); }
#endif
