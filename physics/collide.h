/* SPDX-License-Identifier: GPL-3.0-or-later
 * What becomes of clouds that meet: spheres on straight paths (doc/manual/clouds.md, section 2). Times are
 * relative to now and not above 0; positions are those of now. */
#ifndef TEPHRA_COLLIDE_H
#define TEPHRA_COLLIDE_H
#include <stdbool.h>

/* acc: by what else acts on them; 0 for spheres that are alone. */
struct body { double mass, radius, pos[3], vel[3], acc[3]; };

/* When two spheres, a distance r = pos_b - pos_a apart with the relative velocity v, come as near as `reach` in
 * [from, 0] while they approach each other: the moment in *time; `from` itself if they are nearer already. */
bool collide_contact(const double r[3], const double v[3], double reach, double from, double *time);
/* At `time` the component along the line of centres of their relative velocity becomes -restitution times itself;
 * they go on from where they were. What they have been accelerated by since then stays as it is: flipped with the rest it would
 * be energy from nowhere, of the order of the step. False, and nothing done, if they separate at `time`. lost: grows by the kinetic
 * energy that it takes. shift: what makes b's image the nearest one. Momentum and angular momentum are
 * conserved. */
bool collide_bounce(struct body *a, struct body *b, const double shift[3], double restitution, double time, double *lost);
/* a becomes both, at their centre of mass with their momentum; b is left as it is. Returns the kinetic energy lost, and
 * adds to `spin` the angular momentum of the pair about its centre. The radius of a is left to the caller. */
double collide_merge(struct body *a, const struct body *b, const double shift[3], double spin[3]);
/* Whether the pair is bound: mu v^2/2 < G m_a m_b/reach. */
bool collide_bound(double G, const struct body *a, const struct body *b);
/* Artificial viscosity (Monaghan & Gingold 1983) of overlapping clouds on the line of their centres for a time dt, by the
 * closed form of dw/dt = -(A w + B w^2), w the speed of approach. alpha, beta: its strengths; sound: the speed in its linear
 * term. Returns the kinetic energy lost; 0 if they are apart or separate. */
struct viscosity { double alpha, beta, sound; };
double collide_rub(struct body *a, struct body *b, const double shift[3], const struct viscosity *viscosity, double dt);
#endif
