/* SPDX-License-Identifier: GPL-3.0-or-later
 * Lattices (lattice.h). In a box: the points (i/n, {i a/n}, {i b/n}) times the sides, with whole numbers a
 * and b, are for every n a lattice that the box repeats (Korobov 1959; Niederreiter 1992, "Random Number
 * Generation and Quasi-Monte Carlo Methods", chapter 5). a and b are drawn until no two points are close. */
#include "lattice.h"
#include "fail.h"
#include "mem.h"
#include "random.h"
#include "sort.h"
#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static double square(const double x[3]) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; }

/* The lattice of the ball: whole (x, y, z) with an even sum, one point to two units of volume. Its centre is
 * put where no two points are equally far from it. */
static const double ball_volume = 2.0;
static const double ball_centre[3] = {0.4142135623730950, 0.7320508075688773, 0.2360679774997897};

struct points { double (*pos)[3]; int64_t n; };

/* The lattice points within `radius` of the centre, in the lattice's order; a first walk counts them. */
static struct points ball(double radius)
{
    struct points points = {NULL, 0};
    const int64_t reach = (int64_t)ceil(radius) + 1;
    for (int pass = 0; pass < 2; pass++) {
        int64_t n = 0;
        for (int64_t x = -reach; x <= reach; x++)
            for (int64_t y = -reach; y <= reach; y++) {
                double dx = (double)x - ball_centre[0], dy = (double)y - ball_centre[1];
                double left = radius * radius - dx * dx - dy * dy;
                if (left < 0.0) continue;
                int64_t low = (int64_t)ceil(ball_centre[2] - sqrt(left));
                low += (x + y + low) & 1;
                for (int64_t z = low; (double)z - ball_centre[2] <= sqrt(left); z += 2, n++) {
                    if (pass == 0) continue;
                    points.pos[n][0] = dx;
                    points.pos[n][1] = dy;
                    points.pos[n][2] = (double)z - ball_centre[2];
                }
            }
        if (pass == 0) points.pos = mem_alloc("generator", (size_t)n * sizeof *points.pos);
        points.n = n;
    }
    return points;
}

/* Keeps the n points that are nearest to the centre, in their order. */
static void keep_innermost(struct points *points, int64_t n)
{
    uint64_t *key = mem_array("generator", uint64_t, points->n);
    int32_t *row = mem_array("generator", int32_t, points->n);
    for (int64_t i = 0; i < points->n; i++) {
        double r2 = square(points->pos[i]);
        memcpy(&key[i], &r2, sizeof r2);    /* positive doubles are ordered as their bits are */
        row[i] = (int32_t)i;
    }
    sort_keys(key, row, points->n);
    bool *inside = mem_array("generator", bool, points->n);
    for (int64_t i = 0; i < n; i++) inside[row[i]] = true;
    int64_t kept = 0;
    for (int64_t i = 0; i < points->n; i++)
        if (inside[i]) memmove(points->pos[kept++], points->pos[i], sizeof *points->pos);
    points->n = kept;
    mem_free(key);
    mem_free(row);
    mem_free(inside);
}

double (*lattice_ball(int64_t n))[3]
{
    double radius = cbrt(3.0 * ball_volume * (double)n / (4.0 * PI));
    struct points points = ball(radius + 2.0);
    check(points.n >= n);
    keep_innermost(&points, n);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) points.pos[i][k] /= radius;
    return points.pos;
}

/* Copies of the glass about a point of it; the box of the copies holds the ball and one spacing more. */
double (*lattice_glass_ball(int64_t n))[3]
{
    int side;
    double (*glass)[3] = glass_box(&side), radius = cbrt(3.0 * (double)n / (4.0 * PI));
    const int64_t points = (int64_t)side * side * side, copies = (int64_t)ceil((radius + 2.0) / side);
    struct points all = {NULL, 0};
    for (int pass = 0; pass < 2; pass++) {
        int64_t kept = 0;
        for (int64_t c = 0, width = 2 * copies; c < width * width * width; c++)
            for (int64_t i = 0; i < points; i++) {
                const int64_t copy[3] = {c % width, c / width % width, c / width / width};
                double x[3];
                for (int k = 0; k < 3; k++) x[k] = glass[i][k] + (double)((copy[k] - copies) * side);
                if (square(x) > (radius + 1.0) * (radius + 1.0)) continue;
                if (pass == 1) memcpy(all.pos[kept], x, sizeof x);
                kept++;
            }
        if (pass == 0) all.pos = mem_alloc("generator", (size_t)kept * sizeof *all.pos);
        all.n = kept;
    }
    mem_free(glass);
    check(all.n >= n);
    keep_innermost(&all, n);
    for (int64_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) all.pos[i][k] /= radius;
    return all.pos;
}

/* A lattice by three vectors; `shorten` replaces the longest by what is left of it. */
struct basis { double v[3][3]; };

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void swap(double a[3], double b[3])
{
    for (int k = 0; k < 3; k++) {
        double keep = a[k];
        a[k] = b[k];
        b[k] = keep;
    }
}

static void sort_by_length(struct basis *b)
{
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (square(b->v[i]) > square(b->v[i + 1])) swap(b->v[i], b->v[i + 1]);
}

/* Takes from `x` the whole multiple of `a` that leaves it shortest. */
static void reduce(double x[3], const double a[3])
{
    double times = rint(dot(x, a) / square(a));
    for (int k = 0; k < 3; k++) x[k] -= times * a[k];
}

/* The nearest of the lattice's points in the plane of v[0] and v[1] is taken from v[2]: among the few about
 * the rounded solution of the normal equations. */
static bool shorten(struct basis *b)
{
    const double *u = b->v[0], *v = b->v[1], *w = b->v[2];
    double uu = square(u), vv = square(v), uv = dot(u, v), wu = dot(w, u), wv = dot(w, v), det = uu * vv - uv * uv;
    double p0 = rint((wu * vv - wv * uv) / det), q0 = rint((wv * uu - wu * uv) / det), best = square(w), least[3];
    bool shorter = false;
    for (int p = -1; p <= 1; p++)
        for (int q = -1; q <= 1; q++) {
            double x[3];
            for (int k = 0; k < 3; k++) x[k] = w[k] - (p0 + p) * u[k] - (q0 + q) * v[k];
            if (square(x) >= best * (1.0 - 1e-12)) continue;
            best = square(x);
            memcpy(least, x, sizeof least);
            shorter = true;
        }
    if (shorter) memcpy(b->v[2], least, sizeof least);
    return shorter;
}

/* Squared length of the shortest vector: reduction in three dimensions after Semaev (2001, LNCS 2146, 181). */
static double shortest(struct basis b)
{
    do {
        sort_by_length(&b);
        for (double before = INFINITY; square(b.v[0]) < before;) {
            before = square(b.v[0]);
            reduce(b.v[1], b.v[0]);
            if (square(b.v[1]) < square(b.v[0])) swap(b.v[0], b.v[1]);
        }
    } while (shorten(&b));
    sort_by_length(&b);
    return square(b.v[0]);
}

struct steps { int64_t a, b; };     /* from one point to the next along y and z, in parts of side/n */

static double apart(int64_t n, const double side[3], struct steps s)
{
    double part = 1.0 / (double)n;
    return shortest((struct basis){{{side[0] * part, side[1] * (double)s.a * part, side[2] * (double)s.b * part},
                                    {0, side[1], 0}, {0, 0, side[2]}}});
}

/* Points keep at most 2^(1/6) (volume/n)^(1/3) apart, the densest packing; few lattices
 * come near that. */
static struct steps choose_steps(int64_t n, const double side[3])
{
    enum { TRIES = 100000 };
    const double densest = cbrt(2.0) * pow(side[0] * side[1] * side[2] / (double)n, 2.0 / 3.0), enough = 0.98 * 0.98;
    const struct random key = {1, (uint64_t)n, 0, random_stream("lattice")};
    struct steps best = {0, 0};
    double longest = 0;
    for (uint64_t t = 0; t < TRIES && longest < enough * densest; t++) {
        const double first = random_uniform(&key, 2 * t), second = random_uniform(&key, 2 * t + 1);
        struct steps s = {(int64_t)((double)n * first), (int64_t)((double)n * second)};
        double length = apart(n, side, s);
        if (length <= longest) continue;
        longest = length;
        best = s;
    }
    return best;
}

/* So few points that a box of them is no longer much like a lattice without bounds. */
static const int64_t fewest = 500;

void lattice_box(int64_t n, const double side[3], double (*pos)[3])
{
    check(n < INT32_MAX);   /* products of two counts fit into 63 bits */
    int64_t copies = 1, m = n;
    for (; m % 8 == 0 && m / 8 >= fewest; m /= 8) copies *= 2;
    struct steps s = choose_steps(m, side);
#pragma omp parallel for
    for (int64_t i = 0; i < n; i++) {
        int64_t j = i % m, copy = i / m;
        const int64_t x[3] = {j, j * s.a % m, j * s.b % m};
        const int64_t block[3] = {copy % copies, copy / copies % copies, copy / copies / copies};
        for (int k = 0; k < 3; k++)
            pos[i][k] = side[k] * ((double)block[k] + ((double)x[k] + 0.5) / (double)m) / (double)copies;
    }
}
