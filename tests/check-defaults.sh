#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Defaults that charts decide name their chart, and lie on the front that it measured: no other row of the same
# integrator takes fewer forces at a smaller error (5 % in both, so that equals are no fault).
. "$TEPHRA_SOURCE/tests/lib.sh"
charts=$TEPHRA_SOURCE/doc/charts

# on_front KEY CHART PROBLEM SCHEME
on_front() {
    tephra params "${1%%.*}" >params || fail "no parameters of $1"
    value=$(awk -v key="$1" '$1 == key { print $2 }' params)
    grep -A 2 "^  $1 " params | grep -q "doc/charts/$2: $3, $4" || fail "$1 does not name its row of $2"
    awk -F, -v key="$1" -v value="$value" -v problem="$3" -v scheme="$4" '
        $1 == problem && index($2, scheme) == 1 && $9 == "measured" {
            n++; forces[n] = $5; error[n] = $7
            if ($2 == scheme && $3 == key && $4 == value) own = n
        }
        END {
            if (!own) { print "no row of " key " = " value; exit 1 }
            for (k = 1; k <= n; k++)
                if (forces[k] < 0.95 * forces[own] && error[k] < 0.95 * error[own]) {
                    print key " = " value ": beaten by " forces[k] " forces with an error of " error[k]; exit 1
                }
        }' "$charts/$2" || fail "$1 = $value has left the front of $2"
}

# `preset: modern`: of the variants in sph.csv that are nowhere 5 % worse in density none has errors (density and velocity,
# geometric mean over the problems) that are 5 % smaller.
tephra params sph >params
grep -A 2 '^  sph.preset ' params | tr -d '\n' | grep -q 'doc/charts/sph.csv' || fail "sph.preset does not name its chart"
awk -F, '$2 == "variant" { key = $3; own_key = "preset=modern"; density[key, $1] = $5; sum[key] += log($5 * $6); n[key]++; problem[$1] }
    END {
        if (n[own_key] < 4) { print "no rows of " own_key; exit 1 }
        for (key in sum) {
            worse = n[key] < n[own_key]
            for (p in problem) if (density[key, p] > 1.05 * density[own_key, p]) worse = 1
            if (!worse && exp((sum[key] - sum[own_key]) / (2 * n[key])) < 0.95) { print own_key ": beaten by " key; exit 1 }
        }
    }' "$charts/sph.csv" || fail "sph.preset: modern has left the front of sph.csv"
on_front sph.courant time.csv Evrard leapfrog
on_front gravity.time_step time.csv "cold collapse" leapfrog
finish
