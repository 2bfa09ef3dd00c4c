/* SPDX-License-Identifier: GPL-3.0-or-later
 * Initial mass functions between 0.1 and 100 Msun, normalised to 1 Msun of stars formed. */
#ifndef TEPHRA_IMF_H
#define TEPHRA_IMF_H

/* In the order of IMF_CHOICES. */
enum imf_kind {
    IMF_KROUPA_1993,    /* Kroupa, Tout & Gilmore: slopes 1.3 (to 0.5 Msun), 2.2 (to 1), 2.7 */
    IMF_KROUPA_2001,    /* 1.3 (to 0.5), 2.3 */
    IMF_SALPETER,       /* 2.35 (1955) */
    IMF_CHABRIER_2003,  /* lognormal to 1 Msun, 2.3 above */
    N_IMFS
};
#define IMF_CHOICES "kroupa1993|kroupa2001|salpeter|chabrier"

#define IMF_LOWEST 0.1      /* Msun */
#define IMF_HIGHEST 100.0

/* Stars per Msun of mass and Msun formed at mass m [Msun]; 0 beyond the ends. */
double imf_density(enum imf_kind kind, double m);
#endif
