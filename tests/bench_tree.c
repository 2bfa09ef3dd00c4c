/* SPDX-License-Identifier: GPL-3.0-or-later
 * CPU seconds of a build of the octree: of shuffled rows, and again of rows that have drifted a
 * little since. Usage: bench_tree [N]. A Plummer-like density (n ~ r^-2 core-halo). */
#include "mem.h"
#include "profile.h"
#include "random.h"
#include "sim.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void place(struct species *s, int64_t n)
{
    const enum column columns[] = {COLUMN_pos, COLUMN_vel, COLUMN_mass, COLUMN_id, COLUMN_acc, COLUMN_rung, COLUMN_rung0};
    s->kind = DARK;
    for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) species_need(s, columns[c]);
    species_reserve(s, n);
    s->n = s->n_own = n;
    for (int64_t i = 0; i < n; i++) {
        struct random key = {1, (uint64_t)i + 1, 0, random_stream("bench_tree")};
        double unit[3], r = 1 / sqrt(pow(random_uniform(&key, 9), -2.0 / 3) - 1);
        random_direction(&key, 0, unit);
        for (int d = 0; d < 3; d++) {
            s->pos[i][d] = r * unit[d];
            s->vel[i][d] = 0.3 * random_normal(&key, (uint64_t)d + 2);
        }
        s->mass[i] = 1.0 / (double)n;
        s->id[i] = (uint64_t)i + 1;
    }
}

int main(int argc, char **argv)
{
    int64_t n = argc > 1 ? atoll(argv[1]) : 1000000;
    struct sim *sim = mem_alloc("bench", sizeof *sim);
    sim->time = (struct timeline){.dt_max = 1, .tick_end = INT64_MAX};
    tree_need_leaf(&sim->tree, 32);
    place(&sim->species[DARK], n);
    const char *const names[] = {"shuffled", "in order", "drifted"};
    for (int k = 0; k < 3; k++) {
        if (k == 2)
            for (int64_t i = 0; i < n; i++)
                for (int d = 0; d < 3; d++) sim->species[DARK].pos[i][d] += 0.01 * sim->species[DARK].vel[i][d];
        double cpu = profile_cpu();
        tree_build(sim);
        cpu = profile_cpu() - cpu;
        printf("%-9s %8.4f CPU s for %lld rows, %d cells, %.1f bytes of tree a row\n", names[k], cpu, (long long)n,
               sim->tree.n_nodes, (double)sim->tree.capacity * sizeof(struct node) / (double)n);
    }
    double cpu = profile_cpu();
    sim->time.tick = 1;
    tree_refit(sim);
    printf("refit     %8.2f ns a row\n", 1e9 * (profile_cpu() - cpu) / (double)n);
    return 0;
}
