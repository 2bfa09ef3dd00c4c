/* SPDX-License-Identifier: GPL-3.0-or-later
 * The formulas of the two integrators for one component, in the form that keeps rows synchronous:
 * x, v and a belong to the row's own time. Both predict with the old acceleration; they differ in
 * what the new one corrects. Stability: doc/manual/integrators.md. */
#ifndef TEPHRA_INTEGRATE_H
#define TEPHRA_INTEGRATE_H
#include "hd.h"

/* x + v t + a t^2/2 and v + a t: the predictor, and what a sleeping row is taken to do meanwhile. */
HD double integrate_position(double x, double v, double a, double t) { return x + t * (v + 0.5 * t * a); }
HD double integrate_velocity(double v, double a, double t) { return v + t * a; }

/* Change of the predicted velocity once the acceleration at the end is known: the mean of both acts
 * over the step (velocity Verlet, which is kick-drift-kick; Heun). */
HD double integrate_correction(double a_old, double a_new, double t) { return 0.5 * t * (a_new - a_old); }

/* pec only: the corrected position x + (v + v') t/2 differs from the predicted one by (v' - v_p) t/2. */
HD double integrate_shift(double correction, double t) { return 0.5 * t * correction; }

/* u + du t for a rate that is followed safely, bent to u/4 / |du t/u| for one that would take more
 * than half (value and slope agree at the half), and never less than the smallest normal float:
 * positive whatever du. */
HD float integrate_energy(float u, float du, float t)
{
    const float smallest = 1.17549435e-38f;
    float change = du * t, bent = 0.25f * u * (u / -change);
    return change > -0.5f * u ? u + change : bent > smallest ? bent : smallest;
}
#endif
