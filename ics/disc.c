/* SPDX-License-Identifier: GPL-3.0-or-later
 * Discs (disc.h): moments of the collisionless Boltzmann equation with Gaussian velocities, after Hernquist (1993,
 * ApJS 86, 389) and Springel, Di Matteo & Hernquist (2005, MNRAS 361, 776). */
#include "disc.h"
#include "random.h"
#include <gsl/gsl_sf_bessel.h>
#include <math.h>

static const double PI = 3.14159265358979323846;
/* Mean of (z/z0)^2 where the density is ~ sech^2(z/z0). */
static const double mean_square = 0.822467033424113218;

static double surface(const struct disc *disc, double R)
{
    return disc->mass / (2 * PI * disc->radius * disc->radius) * exp(-R / disc->radius);
}

/* Mass of the spheres within r. */
static double spheres_within(const struct disc_field *field, double r)
{
    double mass = 0;
    for (int k = 0; k < field->spheres; k++) mass += radial_at(&field->all->part[k], r).mass;
    return mass;
}

double disc_speed2(const struct disc_field *field, double R)
{
    double v2 = field->all->G * spheres_within(field, R) / R;
    for (int d = 0; d < 2; d++) {
        const struct disc *disc = field->disc[d];
        if (!(disc->mass > 0)) continue;
        double y = 0.5 * R / disc->radius;  /* I and K with exp(-y) and exp(y) taken out */
        double in = gsl_sf_bessel_I0_scaled(y) * gsl_sf_bessel_K0_scaled(y)
                  - gsl_sf_bessel_I1_scaled(y) * gsl_sf_bessel_K1_scaled(y);
        v2 += 2 * field->all->G * disc->mass / disc->radius * y * y * in;
    }
    return v2;
}

double disc_kappa(const struct disc_field *field, double R)
{
    const double step = 1e-3;
    double below = disc_speed2(field, R * (1 - step)), above = disc_speed2(field, R * (1 + step));
    double slope = (above - below) / (2 * step * R);    /* of v^2: kappa^2 = 2 v^2/R^2 + (dv^2/dR)/R */
    return sqrt(fmax(0, 2 * disc_speed2(field, R) / (R * R) + slope / R));
}

/* The dispersion falls as exp(-R/2a); near the centre as if R were sqrt(R^2 + a^2/8) (Hernquist 1993). */
static double dispersion(const struct disc_field *field, double R)
{
    double a = field->disc[0]->radius;
    return field->sigma * exp(-sqrt(R * R + a * a / 8) / (2 * a));
}

void disc_prepare(struct disc_field *field)
{
    const struct disc *stars = field->disc[0];
    if (!(stars->mass > 0)) return;
    const double R = 2.2 * stars->radius;
    field->sigma = 1;
    field->sigma = stars->q * 3.36 * field->all->G * surface(stars, R) / disc_kappa(field, R) / dispersion(field, R);
}

/* Radius within which the part x of an exponential disc lies: 1 - (1 + y) exp(-y) = x. */
static double radius_of(double x)
{
    double low = 0, high = 60;
    for (int i = 0; i < 60; i++) {
        double y = 0.5 * (low + high);
        if (-expm1(-y) - y * exp(-y) < x) low = y;
        else high = y;
    }
    return 0.5 * (low + high);
}

/* z/z0 below which the part x of a sech^2 layer lies. */
static double height_of(double x) { return atanh(2 * x - 1); }

/* Mean of z K_z over a layer of height z0 in its own field, in that of another layer, and the spheres'. For layers of
 * one height the mean is pi G Sigma z0; a thin layer within a thick one feels 2 pi G Sigma z/z_other. Between them the
 * two forms are joined smoothly. */
static double pull(const struct disc_field *field, int own, double z0, double R)
{
    const struct disc *disc = field->disc[own], *other = field->disc[1 - own];
    const double G = field->all->G, r = sqrt(R * R + z0 * z0);
    double sum = PI * G * surface(disc, R) * z0 + mean_square * z0 * z0 * G * spheres_within(field, r) / (r * r * r);
    if (!(other->mass > 0)) return sum;
    double thick = own == 0 ? 0 : z0 / other->height, thin = 2 * mean_square * thick;
    double part = own == 0 ? 2 * log(2) : thin / (1 + (thin - 1) * fmin(thick, 1));     /* gas is a sheet to the stars */
    return sum + PI * G * surface(other, R) * z0 * part;
}

static void put(const struct rows rows, int64_t i, const double cylinder[3], const double v[3])
{
    double *pos = rows.table->pos[rows.first + i], *vel = rows.table->vel[rows.first + i];
    const double c = cos(cylinder[1]), s = sin(cylinder[1]);
    pos[0] = cylinder[0] * c;
    pos[1] = cylinder[0] * s;
    pos[2] = cylinder[2];
    vel[0] = v[0] * c - v[1] * s;
    vel[1] = v[0] * s + v[1] * c;
    vel[2] = v[2];
}

void disc_fill_stars(const struct disc_field *field, struct rows rows, uint64_t seed, uint64_t stream)
{
    const struct disc *disc = field->disc[0];
#pragma omp parallel for
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {seed, (uint64_t)i + 1, 0, stream};
        double R = disc->radius * radius_of(random_uniform(&key, 0)), z = disc->height * height_of(random_uniform(&key, 1));
        double v2 = disc_speed2(field, R), omega2 = v2 / (R * R), kappa = disc_kappa(field, R);
        double ratio = kappa * kappa / (4 * omega2), sigma = dispersion(field, R);
        double drift = sigma * sigma * (1 - ratio - 2 * R / disc->radius);     /* asymmetric drift */
        const double v[3] = {sigma * random_normal(&key, 2),
                             sqrt(fmax(0, v2 + drift)) + sigma * sqrt(ratio) * random_normal(&key, 3),
                             sqrt(pull(field, 0, disc->height, R)) * random_normal(&key, 4)};
        put(rows, i, (double[3]){R, 2 * PI * random_uniform(&key, 12), z}, v);
    }
    rows_rest(rows);
}

/* The height at which the layer's weight is its pressure: <z K_z> = P/rho. */
static double gas_height(const struct disc_field *field, double R)
{
    double low = 0, high = 10 * field->disc[1]->radius, wanted = field->disc[1]->sound * field->disc[1]->sound;
    for (int i = 0; i < 50; i++) {
        double z0 = 0.5 * (low + high);
        if (pull(field, 1, z0, R) < wanted) low = z0;
        else high = z0;
    }
    return 0.5 * (low + high);
}

void disc_fill_gas(const struct disc_field *field, struct rows rows, double gamma)
{
    /* An additive sequence in three dimensions: powers of 1/1.2207..., the root of x^4 = x + 1, leave the fewest gaps
     * (Roberts 2018; Kronecker). */
    const double root = 1.2207440846057595, sound2 = field->disc[1]->sound * field->disc[1]->sound;
    const struct disc *disc = field->disc[1];
#pragma omp parallel for
    for (int64_t i = 0; i < rows.n; i++) {
        double x[3], part = 1;
        for (int k = 0; k < 3; k++) {
            part /= root;
            x[k] = fmod(0.5 + (double)(i + 1) * part, 1.0);
        }
        x[0] = fmin(x[0], 1 - 1e-6);
        x[2] = fmin(fmax(x[2], 1e-6), 1 - 1e-6);
        double R = disc->radius * radius_of(x[0]), v2 = disc_speed2(field, R) - sound2 * R / disc->radius;
        const double v[3] = {0, sqrt(fmax(0, v2)), 0};
        put(rows, i, (double[3]){R, 2 * PI * x[1], gas_height(field, R) * height_of(x[2])}, v);
        if (rows.table->u) rows.table->u[rows.first + i] = (float)(sound2 / (gamma - 1));
    }
    rows_rest(rows);
}
