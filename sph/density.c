/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the sums over its neighbours say of a row: density, divergence and curl of the velocity, the
 * terms of grad h, and how strong its viscosity is. doc/manual/sph.md, (S2) to (S4), (S10), (S15) to (S19). */
#include "sph.h"
#include <math.h>

/* h d rho/dh is taken seriously down to Omega = 0.1: less comes of rows with neighbours at the edge of
 * their kernel alone. Where h stands at its floor it does not follow the density. */
static float omega_of(const struct sph *sph, const struct sph_density *sum, float rho, float h)
{
    const float least = 0.1f;
    return h > (float)sph->h_min ? fmaxf(sum->swell / (3 * rho), least) : 1;
}

/* Balsara 1995 (eps_B: Steinmetz 1996): 0 in pure shear. */
static float balsara_of(const struct sph *sph, float div, float curl, float c, float h)
{
    float sum = fabsf(div) + curl + (float)sph->balsara_epsilon * c / h;
    return sum > 0 ? fabsf(div) / sum : 1;
}

/* What a row's flow is like: over the step of length t that ends now div v changed at `rate`. */
struct flow { float div, curl, rate, t, c, h; };

/* After Cullen & Dehnen 2010 (eqs. 12 to 16, l = 0.05, with a limiter of Balsara's kind): a row in which
 * gas begins to converge, and does not only shear, gets what the change of div v asks for at once,
 * beside the speed of sound; it decays over h/(2 l c). In parts of alpha. */
static float strength_of(const struct sph *sph, float old, struct flow f)
{
    const float l = 0.05f;
    float sum = f.div * f.div + f.curl * f.curl, shock = sum > 0 ? fmaxf(-f.rate, 0) * f.div * f.div / sum : 0;
    float speed2 = f.h * f.h * shock, all = speed2 + f.c * f.c, least = (float)(sph->alpha_min / fmax(sph->alpha, 1e-30));
    float local = fmaxf(all > 0 ? speed2 / all : 0, least);
    return local > old ? local : local + (old - local) * expf(-f.t * 2 * l * f.c / f.h);
}

/* With the entropy equation u keeps u/rho^(gamma - 1), and so does its rate at the start of the step. */
static void follow_density(const struct sph *sph, const struct species *gas, int32_t i, float rho)
{
    float ratio = powf(rho / gas->rho[i], (float)(sph->gamma - 1));
    gas->u[i] *= ratio;
    if (gas->du_old) gas->du_old[i] *= ratio;
}

void sph_finish_density(const struct sim *sim, const struct sph *sph, int32_t i, const struct sph_density *sum)
{
    const struct species *gas = &sim->species[GAS];
    float h = gas->h[i], t = (float)timeline_step(&sim->time, gas->rung0[i]), before = gas->div_v[i];
    float rho = sum->rho - sph->excess * (float)gas->mass[i] / (h * h * h);
    float omega = sph->grad_h ? omega_of(sph, sum, rho, h) : 1, scale = rho > 0 ? 1 / (omega * rho) : 0;
    float x = sum->curl_x, y = sum->curl_y, z = sum->curl_z;
    float div = sum->div * scale, curl = sqrtf(x * x + y * y + z * z) * scale;
    if (t > 0 && gas->rho[i] > 0 && gas->u && sph->equation == SPH_ENTROPY) follow_density(sph, gas, i, rho);
    gas->rho[i] = rho;
    gas->div_v[i] = div;
    gas->curl_v[i] = curl;
    if (sph->grad_h) gas->omega[i] = omega;
    if (!gas->balsara) return;
    float c = sph_sound_speed(sph, gas->u ? gas->u[i] : 0, rho);
    gas->balsara[i] = sph->balsara ? balsara_of(sph, div, curl, c, h) : 1;
    if (sph->strength == SPH_CONSTANT) return;
    /* Nothing is known of the rate at the start: full strength there. */
    gas->strength[i] = t > 0 ? strength_of(sph, gas->strength[i], (struct flow){div, curl, (div - before) / t, t, c, h}) : 1;
    gas->balsara[i] *= gas->strength[i];
}
