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

/* z/z0 below which the part x of a sech^2 layer lies. */
static double height_of(double x) { return atanh(2 * x - 1); }

/* Of rows of one sech^2 layer of height 1, a distance z from its middle or from each other: means of D = sqrt(z^2 + soft^2)
 * and of z^2/D. Without softening both are ln 2, or 1. */
struct apart { double distance, pull; };

static struct apart apart_of(double soft, bool both)
{
    enum { STEPS = 32 };
    struct apart mean = {0, 0};
    const int others = both ? STEPS : 1;
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < others; j++) {
            double z = height_of((i + 0.5) / STEPS) - (both ? height_of((j + 0.5) / STEPS) : 0), D = sqrt(z * z + soft * soft);
            mean.distance += D / (STEPS * others);
            mean.pull += D > 0 ? z * z / D / (STEPS * others) : 0;
        }
    return mean;
}

static struct apart apart_in(double height, double soft, bool both)
{
    if (!(height > 0)) return (struct apart){soft, 0};
    struct apart mean = apart_of(soft / height, both);
    return (struct apart){height * mean.distance, height * mean.pull};
}

/* By Hankel's transform, k times S(k) = M/(2 pi) (1 + k^2 a^2)^(-3/2) of an exponential disc. Two layers whose rows are on the
 * mean D = sqrt(z^2 + eps^2) apart, with Plummer's softening, attract each other in the plane as exp(-k D) on the mean, 1/(1 +
 * k D) if the distances have an exponential distribution; across it as the mean of k z^2/D exp(-k D). */
static double spectrum(const struct disc *disc, double k)
{
    double x = 1 + k * k * disc->radius * disc->radius;
    return k * disc->mass / (2 * PI) / (x * sqrt(x));
}

/* Squared speed at R by a disc whose rows are on the mean d away: 2 pi G R int k S(k) J1(kR)/(1 + kd) dk. */
static double disc_alone(const struct disc *disc, double d, double R)
{
    const double last = 80 / disc->radius, step = 0.02 / disc->radius;
    double sum = 0;
    for (double k = step; k < last; k += step) sum += spectrum(disc, k) / (1 + k * d) * gsl_sf_bessel_J1(k * R);
    return 2 * PI * R * step * sum;
}

/* Surface density that pulls across the disc as an even sheet of height z0 without softening would. */
static double acting_sheet(const struct disc *disc, struct apart apart, double R)
{
    const double last = 80 / disc->radius, step = 0.02 / disc->radius, d = apart.distance;
    double sum = 0;
    for (double k = step; k < last; k += step) sum += spectrum(disc, k) / ((1 + k * d) * (1 + k * d)) * gsl_sf_bessel_J0(k * R);
    return fmax(0, step * sum) * apart.pull / disc->height;
}

static double radius_at(const struct disc_field *field, int i) { return exp(field->first + field->step * i); }

/* Mean distances in z, without softening: z0 within a sech^2 layer, ln 2 z0 between it and a thin one. */
static void make_tables(struct disc_field *field)
{
    const struct disc *stars = field->disc[DISC_STARS], *gas = field->disc[DISC_GAS];
    const double a = stars->mass > 0 ? stars->radius : gas->radius, soft = field->softening, G = field->all->G;
    const struct apart within = apart_in(stars->height, soft, true), between = apart_in(stars->height, soft, false);
    field->first = log(0.01 * a);
    field->step = log(60 / 0.01) / (DISC_POINTS - 1);
#pragma omp parallel for schedule(dynamic, 4)
    for (int i = 0; i < DISC_POINTS; i++) {
        const double R = radius_at(field, i);
        field->speed2[DISC_STARS][i] = field->speed2[DISC_GAS][i] = 0;
        if (stars->mass > 0) {
            field->speed2[DISC_STARS][i] += G * disc_alone(stars, within.distance, R);
            field->speed2[DISC_GAS][i] += G * disc_alone(stars, between.distance, R);
            field->sheet[i] = acting_sheet(stars, within, R);
        }
        if (gas->mass > 0) {
            field->speed2[DISC_STARS][i] += G * disc_alone(gas, between.distance, R);
            field->speed2[DISC_GAS][i] += G * disc_alone(gas, soft, R);
        }
    }
}

static double from_table(const struct disc_field *field, const double *table, double R)
{
    double place = fmin(fmax((log(R) - field->first) / field->step, 0), DISC_POINTS - 1.001);
    int i = (int)place;
    return table[i] + (place - i) * (table[i + 1] - table[i]);
}

double disc_speed2(const struct disc_field *field, int layer, double R)
{
    return field->all->G * spheres_within(field, R) / R + fmax(0, from_table(field, field->speed2[layer], R));
}

double disc_kappa(const struct disc_field *field, double R)
{
    const double ratio = exp(field->step);      /* kappa^2 = 2 v^2/R^2 + (dv^2/dR)/R */
    double slope = (disc_speed2(field, DISC_STARS, R * ratio) - disc_speed2(field, DISC_STARS, R / ratio)) / (2 * field->step);
    return sqrt(fmax(0, 2 * disc_speed2(field, DISC_STARS, R) + slope)) / R;
}

/* The dispersion falls as exp(-R/2a); near the centre as if R were sqrt(R^2 + a^2/8) (Hernquist 1993). */
static double dispersion(const struct disc_field *field, double R)
{
    double a = field->disc[DISC_STARS]->radius;
    return field->sigma * exp(-sqrt(R * R + a * a / 8) / (2 * a));
}

/* Mean of z K_z over a layer of height z0 in its own field, in that of the other layer, and the spheres'. For layers
 * of one height the mean is pi G Sigma z0; a thin layer within a thick one feels 2 pi G Sigma z/z_other. Between them the
 * two forms are joined smoothly. The stars' Sigma is the sheet that acts, less than what is there towards the centre. */
static double pull(const struct disc_field *field, int own, double z0, double R)
{
    const struct disc *gas = field->disc[DISC_GAS];
    const double G = field->all->G, r = sqrt(R * R + z0 * z0), soft = field->softening;
    double sum = mean_square * z0 * z0 * G * spheres_within(field, r) / (r * r * r);
    double stars = PI * G * z0 * from_table(field, field->sheet, R), layer = gas->mass > 0 ? PI * G * surface(gas, R) : 0;
    if (own == DISC_STARS) return sum + stars + 2 * layer * apart_in(z0, soft, false).pull; /* gas is a thin sheet to the stars */
    double thick = z0 / fmax(field->disc[DISC_STARS]->height, z0), thin = 2 * mean_square * thick;
    return sum + layer * apart_in(z0, soft, true).pull + stars * thin / (1 + (thin - 1) * thick);
}

/* P/rho of a layer of gas, a mean over its mass: of sech^(4/3) that is sqrt(pi) Gamma(5/3)/(2 Gamma(13/6)). */
static double layer_heat(const struct disc *gas, double z0, double R)
{
    const double mean = 0.739188;
    double stiffening = isnan(gas->stiff) ? 0 : mean * pow(surface(gas, R) / (2 * z0) / gas->stiff, 2.0 / 3);
    return gas->sound * gas->sound * (1 + stiffening);
}

/* The height at which the layer's weight is its pressure: <z K_z> = <P/rho>. */
static double gas_height(const struct disc_field *field, double R)
{
    const struct disc *gas = field->disc[DISC_GAS];
    double low = 0, high = 10 * gas->radius;
    for (int i = 0; i < 40; i++) {
        double z0 = 0.5 * (low + high);
        if (pull(field, DISC_GAS, z0, R) < layer_heat(gas, z0, R)) low = z0;
        else high = z0;
    }
    return 0.5 * (low + high);
}

static void lay_gas(struct disc_field *field)
{
#pragma omp parallel for schedule(dynamic, 4)
    for (int i = 0; i < DISC_POINTS; i++) {
        const double R = radius_at(field, i);
        field->height[i] = gas_height(field, R);
        field->heat[i] = layer_heat(field->disc[DISC_GAS], field->height[i], R);
    }
}

void disc_prepare(struct disc_field *field)
{
    const struct disc *stars = field->disc[DISC_STARS];
    make_tables(field);
    if (field->disc[DISC_GAS]->mass > 0) lay_gas(field);
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
    const struct disc *disc = field->disc[DISC_STARS];
#pragma omp parallel for
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {seed, (uint64_t)i + 1, 0, stream};
        double R = disc->radius * radius_of(random_uniform(&key, 0)), z = disc->height * height_of(random_uniform(&key, 1));
        double v2 = disc_speed2(field, DISC_STARS, R), omega2 = v2 / (R * R), kappa = disc_kappa(field, R);
        double ratio = kappa * kappa / (4 * omega2), sigma = dispersion(field, R);
        double drift = sigma * sigma * (1 - ratio - 2 * R / disc->radius);     /* asymmetric drift */
        const double v[3] = {sigma * random_normal(&key, 2),
                             sqrt(fmax(0, v2 + drift)) + sigma * sqrt(ratio) * random_normal(&key, 3),
                             sqrt(pull(field, DISC_STARS, disc->height, R)) * random_normal(&key, 4)};
        put(rows, i, (double[3]){R, 2 * PI * random_uniform(&key, 12), z}, v);
    }
    rows_rest(rows);
}

void disc_fill_gas(const struct disc_field *field, struct rows rows, double gamma, uint64_t seed, uint64_t stream)
{
    /* An additive sequence in three dimensions: powers of 1/1.2207..., the root of x^4 = x + 1, leave the fewest gaps
     * (Roberts 2018; Kronecker). Each place is moved at random within its own n^(-1/3), since the sequence alone shows
     * as spiral arms. */
    const double root = 1.2207440846057595, ratio = exp(field->step);
    const double spacing = cbrt(1 / (double)rows.n);
    const struct disc *disc = field->disc[DISC_GAS];
#pragma omp parallel for
    for (int64_t i = 0; i < rows.n; i++) {
        const struct random key = {seed, (uint64_t)i + 1, 0, stream};
        double x[3], part = 1;
        for (int k = 0; k < 3; k++) {
            part /= root;
            x[k] = fmod(0.5 + (double)(i + 1) * part, 1.0) + spacing * (random_uniform(&key, (uint64_t)k) - 0.5);
            x[k] -= floor(x[k]);
        }
        x[0] = fmin(x[0], 1 - 1e-6);
        x[2] = fmin(fmax(x[2], 1e-6), 1 - 1e-6);
        double R = disc->radius * radius_of(x[0]), heat = from_table(field, field->heat, R);
        double rise = (from_table(field, field->heat, R * ratio) - from_table(field, field->heat, R / ratio)) / (2 * field->step);
        const double v[3] = {0, sqrt(fmax(0, disc_speed2(field, DISC_GAS, R) - heat * R / disc->radius + rise)), 0};
        put(rows, i, (double[3]){R, 2 * PI * x[1], from_table(field, field->height, R) * height_of(x[2])}, v);
        if (rows.table->u) rows.table->u[rows.first + i] = (float)(heat / (gamma - 1));
    }
    rows_rest(rows);
}
