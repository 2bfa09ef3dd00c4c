/* SPDX-License-Identifier: GPL-3.0-or-later
 * The table of `accuracy` (gravity/settings.c) and the shipped chart that it is taken from. */
#include "gravity_case.h"

/* A row of the shipped chart, over all its sets. */
struct charted { char row[64], method[64]; int order, sets; double opening, cpu, worst; };
enum { CHARTED = 256, SETS = 4 };

/* Reads the rows with the sizes and the precision of the table, whose names have three words more than none. */
static int read_chart(FILE *chart, struct charted *rows)
{
    char line[1024];
    int n = 0;
    while (fgets(line, sizeof line, chart)) {
        struct charted c = {.sets = 1};
        char set[32];
        double rows_of_set;
        int words = 0, k = 0;
        if (sscanf(line, "%31[^,],%lf,%63[^,],%63[^,],%d,%lf,%*d,%*d,%*[^,],%*f,%lf,%*f,%*f,%*f,%*f,%lf", set, &rows_of_set, c.row,
                   c.method, &c.order, &c.opening, &c.cpu, &c.worst) != 8) continue;
        for (const char *letter = c.row; *letter; letter++) words += *letter == ' ';
        if (words != 3) continue;
        c.cpu = strcmp(set, "plummer") == 0 ? 1e6 * c.cpu / rows_of_set : 0;
        while (k < n && strcmp(rows[k].row, c.row) != 0) k++;
        if (k == n) {
            assert_true(n < CHARTED);
            rows[n++] = c;
            continue;
        }
        rows[k].worst = fmax(rows[k].worst, c.worst);
        rows[k].cpu += c.cpu;
        rows[k].sets++;
    }
    return n;
}

/* Parts by which times vary from chart to chart, and errors with the last digits of the forces. */
static const double times_vary = 0.5, choice_varies = 0.15, errors_vary = 0.02;

/* The table of `accuracy` is the shipped chart's: every entry is the row that it names, with the worst error of all
 * sets, and no row that holds the accuracy on all of them is clearly cheaper. */
static void check_front(enum gravity_solver solver, const char *method, const struct charted *rows, int n)
{
    for (const struct gravity_front *front = gravity_settings_front(solver); front->row; front++) {
        double least = INFINITY, chosen = INFINITY;
        for (const struct charted *c = rows; c < rows + n; c++) {
            if (strncmp(c->method, method, strlen(method)) != 0) continue;
            assert_int_equal(c->sets, SETS);
            if (c->worst <= front->accuracy) least = fmin(least, c->cpu);
            if (strcmp(c->row, front->row) != 0) continue;
            assert_int_equal(c->order, front->order);
            assert_true(c->opening == front->opening && c->worst <= front->accuracy);
            assert_true(fabs(c->worst - front->p99) <= errors_vary * c->worst);
            assert_true(fabs(c->cpu - front->cpu) <= times_vary * fmax(c->cpu, front->cpu));
            chosen = c->cpu;
        }
        assert_true(chosen <= (1 + choice_varies) * least);
    }
}

/* What `accuracy` chose for the chart's sets held on each of them. */
static void check_held(FILE *chart)
{
    char line[1024];
    int n = 0;
    rewind(chart);
    while (fgets(line, sizeof line, chart)) {
        const char *by = strstr(line, " by accuracy ");
        double asked, held;
        if (!by || sscanf(by, " by accuracy %lf,%*[^,],%*d,%*f,%*d,%*d,%*[^,],%*f,%*f,%*f,%*f,%*f,%*f,%lf", &asked, &held) != 2) continue;
        assert_true(held <= asked);
        n++;
    }
    assert_true(n >= 3 * SETS);
}

static void test_front(void **state)
{
    (void)state;
    char *path = mem_format("test", "%s/doc/charts/gravity.csv", getenv("TEPHRA_SOURCE") ? getenv("TEPHRA_SOURCE") : ".");
    FILE *chart = fopen(path, "r");
    assert_non_null(chart);
    struct charted *rows = mem_alloc("test", CHARTED * sizeof *rows);
    int n = read_chart(chart, rows);
    check_front(SOLVER_FMM, "fmm", rows, n);
    check_front(SOLVER_TREE, "tree", rows, n);
    check_held(chart);
    mem_free(rows);
    fclose(chart);
    mem_free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_front),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
