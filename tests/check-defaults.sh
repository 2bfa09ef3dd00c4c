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
on_front sph.courant time.csv Evrard leapfrog
on_front gravity.time_step time.csv "cold collapse" leapfrog
finish
