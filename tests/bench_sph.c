/* SPDX-License-Identifier: GPL-3.0-or-later
 * CPU time of H, DENSITY and FORCE with all rows active, on a sphere of density 1/r, and pairs within
 * the kernel that FORCE computes a second: bench_sph [rows [times [sph.key=value ...]]]. The best of
 * `times` is told. */
#include "sph_case.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double cpu_now(void) { return (double)clock() / CLOCKS_PER_SEC; }

int main(int argc, char **argv)
{
    int64_t n = argc > 1 ? atoll(argv[1]) : 100000;
    int times = argc > 2 ? atoi(argv[2]) : 3;
    struct sim *sim = case_new(n, case_evrard, argc > 3 ? (const char *const *)argv + 3 : NULL);
    const int hooks[] = {HOOK_H, HOOK_DENSITY, HOOK_FORCE};
    double best[3] = {1e30, 1e30, 1e30}, sum = 0;
    case_arrange(sim);
    case_density(sim);
    case_force(sim);
    for (int k = 0; k < 3; k++) {
        for (int t = 0; t < times; t++) {
            double start = cpu_now();
            sph_module.hook[hooks[k]](sim, case_sph(sim));
            best[k] = fmin(best[k], cpu_now() - start);
        }
        printf("%-8s %6.3f microseconds a row\n", hook_names[hooks[k]], best[k] / (double)n * 1e6);
        sum += best[k];
    }
    double pairs = (double)n * (double)case_sph(sim)->neighbours;
    printf("together %6.3f microseconds a row; FORCE %.3g neighbours a second and core\n", sum / (double)n * 1e6,
           pairs / best[2]);
    case_free(sim);
    return 0;
}
