/* SPDX-License-Identifier: GPL-3.0-or-later
 * What Hermite's schemes keep of a row, and its prediction: on the CPU and on a device. */
#ifndef TEPHRA_GRAVITY_HERMITE_PREDICT_H
#define TEPHRA_GRAVITY_HERMITE_PREDICT_H
#include "hd.h"

enum { HERMITE_P_MIN = 2, HERMITE_P_MAX = 4, HERMITE_DERIVATIVES = 2 * HERMITE_P_MAX };

/* Derivatives that a row keeps, f^(0) to f^(2p-3): with them the predicted place errs by dt^(2p), its force too, and
 * the velocity by dt^(2p+1), as the corrector does. */
HD int hermite_kept(int p) { return 2 * p - 2; }

/* Taylor's series of `terms` numbers d[0], d[1], ... to a time t later. */
HD double hermite_taylor(const double *d, int terms, double t)
{
    const double part[HERMITE_DERIVATIVES] = {1, 1, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7};
    double sum = d[terms - 1];
    for (int m = terms - 1; m > 0; m--) sum = d[m - 1] + t * part[m] * sum;
    return sum;
}
#endif
