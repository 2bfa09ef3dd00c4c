/* SPDX-License-Identifier: GPL-3.0-or-later
 * Random velocity fields (turbulence.h) by FFTW, one component after the other. */
#include "turbulence.h"
#include "mem.h"
#include "random.h"
#include <complex.h>
#include <fftw3.h>
#include <math.h>
#include <stdbool.h>

/* The vector amplitude of a mode: normal numbers, split into the part along k and that across, weighted. The modes k and
 * -k are conjugate, so that the field is real. */
static void amplitude(const struct turbulence *field, const int wave[3], double complex a[3])
{
    const int *w = wave;
    bool mirror = w[2] < 0 || (w[2] == 0 && (w[1] < 0 || (w[1] == 0 && w[0] < 0)));
    double k2 = 0;
    uint64_t id = 0;
    for (int d = 0; d < 3; d++) {
        k2 += w[d] * w[d];
        id = id << 21 | (uint64_t)((mirror ? -w[d] : w[d]) + (1 << 20));
        a[d] = 0;
    }
    if (!(k2 > 0) || k2 > (double)(field->waves * field->waves)) return;
    const struct random key = {field->seed, id, 0, field->stream};
    double complex along = 0;
    for (int d = 0; d < 3; d++) {
        a[d] = random_normal(&key, (uint64_t)(2 * d)) + (mirror ? -I : I) * random_normal(&key, (uint64_t)(2 * d + 1));
        along += a[d] * w[d] / k2;
    }
    double size = pow(k2, -0.25 * field->slope - 0.5);      /* E(k) ~ k^2 |a|^2 */
    double across = sqrt(1.5 * field->solenoidal), parallel = sqrt(3 * (1 - field->solenoidal));
    for (int d = 0; d < 3; d++) a[d] = size * (across * (a[d] - along * w[d]) + parallel * along * w[d]);
}

/* The component d of the field on a mesh of m^3 points; returns its mean square. */
static double synthesize(const struct turbulence *field, int m, int d, double *mesh)
{
    const int half = m / 2 + 1;
    fftw_complex *mode = fftw_alloc_complex((size_t)m * (size_t)m * (size_t)half);
    fftw_plan plan = fftw_plan_dft_c2r_3d(m, m, m, mode, mesh, FFTW_ESTIMATE);
#pragma omp parallel for
    for (int x = 0; x < m; x++)
        for (int y = 0; y < m; y++)
            for (int z = 0; z < half; z++) {
                const int wave[3] = {x <= m / 2 ? x : x - m, y <= m / 2 ? y : y - m, z};
                double complex a[3];
                amplitude(field, wave, a);
                mode[((int64_t)x * m + y) * half + z] = a[d];
            }
    fftw_execute(plan);
    fftw_destroy_plan(plan);
    fftw_free(mode);
    double sum = 0;
    for (int64_t i = 0; i < (int64_t)m * m * m; i++) sum += mesh[i] * mesh[i];
    return sum / ((double)m * m * m);
}

static double at(const double *mesh, int m, const double place[3])
{
    double sum = 0;
    int cell[3];
    double along[3];
    for (int d = 0; d < 3; d++) {
        cell[d] = (int)floor(place[d]);
        along[d] = place[d] - cell[d];
    }
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        int64_t index = 0;
        for (int d = 0; d < 3; d++) {
            int up = corner >> d & 1;
            weight *= up ? along[d] : 1 - along[d];
            index = index * m + (((cell[d] + up) % m) + m) % m;
        }
        sum += weight * mesh[index];
    }
    return sum;
}

void turbulence_fill(const struct turbulence *field, double side, int64_t n, double (*pos)[3], double (*vel)[3])
{
    const int m = 4 * (int)field->waves;
    double *mesh = fftw_alloc_real((size_t)m * (size_t)m * (size_t)m), square = 0;
    for (int d = 0; d < 3; d++) {
        square += synthesize(field, m, d, mesh);
#pragma omp parallel for
        for (int64_t i = 0; i < n; i++) {
            double place[3];
            for (int k = 0; k < 3; k++) place[k] = (pos[i][k] / side + 0.5) * m;
            vel[i][d] = at(mesh, m, place);
        }
    }
    for (int64_t i = 0; i < n; i++)
        for (int d = 0; d < 3; d++) vel[i][d] /= sqrt(square);
    fftw_free(mesh);
}
