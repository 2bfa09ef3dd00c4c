/* SPDX-License-Identifier: GPL-3.0-or-later
 * Formulas of a single row of gas, shared by the CPU and a device: where it is and what it is like now, what the sums over its
 * neighbours make of it. `gas` is the table, on a device as its kernels see it (device_rows.h). */
#ifndef TEPHRA_SPH_ROW_H
#define TEPHRA_SPH_ROW_H
#include "integrate.h"
#include "pair.h"
#include "species.h"
#include "timeline.h"

/* The equation of state, and what else of the module's parameters a row needs. */
struct sph_law {
    bool adiabatic, barotropic, entropy, grad_h, balsara, shocks;
    float excess;                   /* of a row's own density, over m/h^3 */
    double gamma, sound_speed, stiff_density, h_min, balsara_epsilon, alpha, alpha_min;
};

/* Of a sleeping row; 0 of an active one. */
HD double sph_row_lag(const struct timeline *time, const struct species *gas, int64_t i)
{ return timeline_lag(time, gas->rung[i], gas->rung0[i]); }

/* While a row sleeps, its density and smoothing length follow the divergence of the velocity that it
 * last had, d ln rho/dt = -div v = -3 d ln h/dt; h is taken to grow by a tenth at most, which the
 * search by h_max allows for. (Kept constant, they cost Evrard's collapse of 4000 rows five times the
 * energy error.) t: time since. */
#define SPH_GROWTH 0.1f
HD float sph_row_rho(const struct species *gas, int64_t i, float t)
{ return t > 0 ? gas->rho[i] * expf(-gas->div_v[i] * t) : gas->rho[i]; }
HD float sph_row_h(const struct species *gas, int64_t i, float t)
{
    float growth = gas->div_v[i] * t / 3;
    return t > 0 ? gas->h[i] * expf(growth < SPH_GROWTH ? growth : SPH_GROWTH) : gas->h[i];
}

/* Before the search: what div v made of h during the step of length `step` that ends now, for a sleeping
 * row (t > 0) what it is. Only where a search begins, and the length of lists, depend on it. */
HD float sph_row_h_expected(const struct species *gas, int64_t i, float t, float step)
{
    float growth = gas->div_v[i] * step / 3;
    if (t > 0) return sph_row_h(gas, i, t);
    growth = growth < SPH_GROWTH ? growth : SPH_GROWTH;
    growth = growth > -SPH_GROWTH ? growth : -SPH_GROWTH;
    return gas->h[i] * (1 + growth * (1 + 0.5f * growth));
}

/* Gas without an energy equation: P/rho = c^2, or c^2 [1 + (rho/rho_a)^(2/3)]: isothermal up to about rho_a, adiabatic
 * with gamma = 5/3 beyond (as Bate, Bonnell & Bromm 2003, MNRAS 339, 577, but without a corner). */
HD float sph_law_stiffening(struct sph_law law, float rho)
{
    float part = law.barotropic ? cbrtf(rho / (float)law.stiff_density) : 0;
    return part * part;
}

/* Sound speed of gas with specific internal energy u (ignored without an energy equation) and density rho (which counts in
 * barotropic gas alone): the root of dP/drho. */
HD float sph_law_sound_speed(struct sph_law law, float u, float rho)
{
    if (law.adiabatic) return sqrtf((float)(law.gamma * (law.gamma - 1)) * u);
    return (float)law.sound_speed * sqrtf(1 + 5.0f / 3 * sph_law_stiffening(law, rho));
}

/* A row now, about any place and velocity. */
HD struct sph_place sph_row_place(const double origin[3], const double vel[3], const struct timeline *time,
                                  const struct species *gas, int64_t i)
{
    const double t = sph_row_lag(time, gas, i);
    float x[3], v[3];
    for (int k = 0; k < 3; k++) {
        const double a = (double)gas->acc[i][k];
        x[k] = (float)(integrate_position(gas->pos[i][k], gas->vel[i][k], a, t) - origin[k]);
        v[k] = (float)(integrate_velocity(gas->vel[i][k], a, t) - vel[k]);
    }
    struct sph_place place = {x[0], x[1], x[2], 0.5f * sph_row_h(gas, i, (float)t), v[0], v[1], v[2], (float)gas->mass[i]};
    return place;
}

/* What the force needs of a row now. */
HD struct sph_state sph_row_state(struct sph_law law, const struct timeline *time, const struct species *gas, int64_t i)
{
    const float t = (float)sph_row_lag(time, gas, i), rho = sph_row_rho(gas, i, t);
    float u = 0, p;
    if (!law.adiabatic) {
        p = (float)(law.sound_speed * law.sound_speed) * (1 + sph_law_stiffening(law, rho)) / rho;
    } else {
        const float per_rho = (float)(law.gamma - 1);
        u = gas->u[i];
        if (t > 0) u = integrate_energy(u, gas->du[i], t);
        if (t > 0 && law.entropy) u *= expf(-per_rho * gas->div_v[i] * t);
        p = per_rho * u / rho;
    }
    if (law.grad_h) p /= gas->omega[i];
    struct sph_state state = {p, rho, 0.5f * sph_law_sound_speed(law, u, rho), gas->balsara ? gas->balsara[i] : 1.0f};
    return state;
}

/* h d rho/dh is taken seriously down to Omega = 0.1: less comes of rows with neighbours at the edge of
 * their kernel alone. Where h stands at its floor it does not follow the density. */
HD float sph_omega(struct sph_law law, float swell, float rho, float h)
{
    const float least = 0.1f, omega = swell / (3 * rho);
    return h > (float)law.h_min ? fmaxf(omega, least) : 1;
}

/* Balsara 1995 (eps_B: Steinmetz 1996): 0 in pure shear. */
HD float sph_balsara(struct sph_law law, float div, float curl, float c, float h)
{
    float sum = fabsf(div) + curl + (float)law.balsara_epsilon * c / h;
    return sum > 0 ? fabsf(div) / sum : 1;
}

/* What a row's flow is like: over the step of length t that ends now div v changed at `rate`. */
struct sph_flow { float div, curl, rate, t, c, h; };

/* After Cullen & Dehnen 2010 (eqs. 12 to 16, l = 0.05, with a limiter of Balsara's kind): a row in which
 * gas begins to converge, and does not only shear, gets what the change of div v asks for at once,
 * beside the speed of sound; it decays over h/(2 l c). In parts of alpha. */
HD float sph_strength(struct sph_law law, float old, struct sph_flow f)
{
    const float l = 0.05f;
    float sum = f.div * f.div + f.curl * f.curl, shock = sum > 0 ? fmaxf(-f.rate, 0) * f.div * f.div / sum : 0;
    float speed2 = f.h * f.h * shock, all = speed2 + f.c * f.c, least = (float)(law.alpha_min / fmax(law.alpha, 1e-30));
    float local = fmaxf(all > 0 ? speed2 / all : 0, least);
    return local > old ? local : local + (old - local) * expf(-f.t * 2 * l * f.c / f.h);
}

/* With the entropy equation u keeps u/rho^(gamma - 1), and so does its rate at the start of the step. */
HD void sph_follow_density(struct sph_law law, const struct species *gas, int64_t i, float rho)
{
    float ratio = powf(rho / gas->rho[i], (float)(law.gamma - 1));
    gas->u[i] *= ratio;
    if (gas->du_old) gas->du_old[i] *= ratio;
}

/* What the sums over its neighbours say of a row: density, derivatives of the velocity, the terms of grad h, and how strong its
 * viscosity is. t: length of the step that ends now. doc/manual/sph.md, (S2) to (S4), (S10), (S15) to (S19). */
HD void sph_row_density(struct sph_law law, const struct species *gas, int64_t i, float t, struct sph_density sum)
{
    const float h = gas->h[i], before = gas->div_v[i];
    const float rho = sum.rho - law.excess * (float)gas->mass[i] / (h * h * h);
    const float omega = law.grad_h ? sph_omega(law, sum.swell, rho, h) : 1, scale = rho > 0 ? 1 / (omega * rho) : 0;
    const float x = sum.curl_x, y = sum.curl_y, z = sum.curl_z;
    const float div = sum.div * scale, curl = sqrtf(x * x + y * y + z * z) * scale;
    if (t > 0 && gas->rho[i] > 0 && gas->u && law.entropy) sph_follow_density(law, gas, i, rho);
    gas->rho[i] = rho;
    gas->div_v[i] = div;
    gas->curl_v[i] = curl;
    if (law.grad_h) gas->omega[i] = omega;
    if (!gas->balsara) return;
    const float c = sph_law_sound_speed(law, gas->u ? gas->u[i] : 0, rho);
    gas->balsara[i] = law.balsara ? sph_balsara(law, div, curl, c, h) : 1;
    if (!law.shocks) return;
    /* Nothing is known of the rate at the start: full strength there. */
    struct sph_flow flow = {div, curl, t > 0 ? (div - before) / t : 0, t, c, h};
    gas->strength[i] = t > 0 ? sph_strength(law, gas->strength[i], flow) : 1;
    gas->balsara[i] *= gas->strength[i];
}

/* The smoothing length of a row whose squared radius r2 holds what it looks for; scale: for a set of too few rows. */
HD float sph_row_length(struct sph_law law, float r2, double scale)
{ return (float)fmax(0.5 * sqrt((double)r2) * scale, law.h_min); }
#endif
