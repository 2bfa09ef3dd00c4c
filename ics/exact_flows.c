/* SPDX-License-Identifier: GPL-3.0-or-later
 * Similarity solutions of the strong explosion (Sedov 1959; Landau & Lifshitz, "Fluid Mechanics", section
 * 106) and of Noh's implosion (1987, J. Comput. Phys. 72, 78), and Riemann's simple wave (Landau & Lifshitz,
 * section 101). */
#include "exact.h"
#include <gsl/gsl_integration.h>
#include <math.h>

static const double PI = 3.14159265358979323846;

/* V, G and Z of Landau & Lifshitz: v = 2r/(5t) V, rho = rho_1 G, c^2 = 4r^2/(25t^2) Z. */
struct similar { double V, G, Z; };

/* (r/R)^5 at V: 0 at V = 1/gamma, 1 at V = 2/(gamma + 1) (LL 106.11). */
static double lambda_5(double gamma, double V)
{
    double nu1 = -(13.0 * gamma * gamma - 7.0 * gamma + 12.0) / ((3.0 * gamma - 1.0) * (2.0 * gamma + 1.0));
    double nu2 = 5.0 * (gamma - 1.0) / (2.0 * gamma + 1.0);
    return pow(0.5 * (gamma + 1.0) * V, -2.0)
         * pow((gamma + 1.0) / (7.0 - gamma) * (5.0 - (3.0 * gamma - 1.0) * V), nu1)
         * pow((gamma + 1.0) / (gamma - 1.0) * (gamma * V - 1.0), nu2);
}

static struct similar similar_at(double gamma, double lambda)
{
    double low = 1.0 / gamma, high = 2.0 / (gamma + 1.0), V = high;
    for (int k = 0; k < 100 && lambda < 1.0; k++) {
        V = 0.5 * (low + high);
        *(lambda_5(gamma, V) < pow(lambda, 5.0) ? &low : &high) = V;
    }
    double nu1 = -(13.0 * gamma * gamma - 7.0 * gamma + 12.0) / ((3.0 * gamma - 1.0) * (2.0 * gamma + 1.0));
    double nu3 = 3.0 / (2.0 * gamma + 1.0), nu4 = -nu1 / (2.0 - gamma), nu5 = -2.0 / (2.0 - gamma);
    double strong = (gamma + 1.0) / (gamma - 1.0);
    struct similar s = {.V = V, .Z = gamma * (gamma - 1.0) * (1.0 - V) * V * V / (2.0 * (gamma * V - 1.0))};
    s.G = strong * pow(strong * (gamma * V - 1.0), nu3) * pow(strong * (1.0 - V), nu5)
        * pow((gamma + 1.0) / (7.0 - gamma) * (5.0 - (3.0 * gamma - 1.0) * V), nu4);
    return s;
}

static double energy_density(double lambda, void *gamma_of)
{
    double gamma = *(const double *)gamma_of;
    struct similar s = similar_at(gamma, lambda);
    return s.G * (0.5 * s.V * s.V + s.Z / (gamma * (gamma - 1.0))) * pow(lambda, 4.0);
}

/* The constant follows from the energy within the shock (LL 106.14). */
struct exact_sedov exact_sedov(double gamma)
{
    double integral, error;
    size_t evaluations;
    gsl_function f = {energy_density, &gamma};
    gsl_integration_qng(&f, 0.02, 1.0, 0.0, 1e-8, &integral, &error, &evaluations);
    return (struct exact_sedov){gamma, pow(16.0 * PI / 25.0 * integral, -0.2)};
}

struct exact_state exact_sedov_at(const struct exact_sedov *s, double lambda)
{
    if (lambda > 1.0) return (struct exact_state){1.0, 0.0, 0.0};
    struct similar at = similar_at(s->gamma, lambda);
    return (struct exact_state){at.G, 0.4 * lambda * at.V, 0.16 * lambda * lambda * at.G * at.Z / s->gamma};
}

struct exact_state exact_noh(double gamma, double r, double t)
{
    double shock = 0.5 * (gamma - 1.0) * t, dense = pow((gamma + 1.0) / (gamma - 1.0), 3.0);
    if (r > shock) return (struct exact_state){(1.0 + t / r) * (1.0 + t / r), -1.0, 0.0};
    return (struct exact_state){dense, 0.0, 0.5 * (gamma - 1.0) * dense};
}

/* Along dx/dt = v + c nothing changes, and c = 1 + (gamma - 1)/2 v; bisection for where the line began. */
struct exact_state exact_wave(double gamma, double amplitude, double x, double t)
{
    double low = x - t * (1.0 + (gamma + 1.0) * amplitude), high = x - t * (1.0 - (gamma + 1.0) * amplitude), v = 0.0;
    for (int k = 0; k < 200; k++) {
        double from = 0.5 * (low + high);
        v = amplitude * sin(2.0 * PI * from);
        *(from + t * (1.0 + 0.5 * (gamma + 1.0) * v) < x ? &low : &high) = from;
    }
    double c = 1.0 + 0.5 * (gamma - 1.0) * v, rho = pow(c, 2.0 / (gamma - 1.0));
    return (struct exact_state){rho, v, rho * c * c / gamma};
}
