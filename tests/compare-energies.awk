# SPDX-License-Identifier: GPL-3.0-or-later
# Prints the energies of a run beside a reference: awk -f compare-energies.awk REFERENCE.csv energy.csv
# Both have a header line whose names are t, kinetic, thermal and potential, with or without units. A
# comment of the reference may say "Extrema: kinetic 0.452 at t = 0.876, thermal 1.763 at ...".
BEGIN {
    FS = ","
    split("kinetic thermal potential", name, " ")
}
/^#/ { comment = comment " " $0; next }
!head[FILENAME]++ {
    file++
    for (i = 1; i <= NF; i++) { sub(/ *\[.*/, "", $i); gsub(/^ +| +$/, "", $i); column[file, $i] = i }
    next
}
{
    n[file]++
    t[file, n[file]] = $column[file, "t"]
    for (k = 1; k <= 3; k++) value[file, n[file], k] = $column[file, name[k]]
}
# Energy k of the run at time s, by linear interpolation.
function at(s, k,   i, w) {
    for (i = 2; i < n[2] && t[2, i] < s; i++);
    w = (s - t[2, i - 1]) / (t[2, i] - t[2, i - 1])
    return value[2, i - 1, k] + w * (value[2, i, k] - value[2, i - 1, k])
}
# The row at which energy k of a file is largest (sign 1) or smallest (sign -1).
function extreme(f, k, sign,   i, best) {
    best = 1
    for (i = 2; i <= n[f]; i++) if (sign * (value[f, i, k] - value[f, best, k]) > 0) best = i
    return best
}
END {
    if (n[1] < 2 || n[2] < 2) { print "compare-energies: a file holds no energies" > "/dev/stderr"; exit 1 }
    printf "%6s %30s %30s %30s\n", "", "kinetic", "thermal", "potential"
    printf "%6s", "t"
    for (k = 1; k <= 3; k++) printf " %10s %10s %8s", "tephra", "reference", "diff."
    printf "\n"
    for (i = 1; i <= n[1]; i++) {
        if (t[1, i] > t[2, n[2]] || t[1, i] * 10 % 2 > 1e-9) continue
        printf "%6.2f", t[1, i]
        for (k = 1; k <= 3; k++) {
            v = at(t[1, i], k)
            printf " %10.4f %10.4f %+8.4f", v, value[1, i, k], v - value[1, i, k]
        }
        printf "\n"
    }
    sub(/.*Extrema:/, "", comment)
    for (k = 1; k <= 3; k++) {
        a = extreme(2, k, (k == 3 ? -1 : 1))
        printf "%s %s: %.3f at t = %.3f", (k == 3 ? "smallest" : "largest"), name[k], value[2, a, k], t[2, a]
        if (match(comment, name[k] " -?[0-9.]+")) {
            best = substr(comment, RSTART + length(name[k]) + 1, RLENGTH - length(name[k]) - 1)
            printf "; reference %.3f, %.0f %% off", best, 100 * (value[2, a, k] / best - 1)
        }
        printf "\n"
    }
}
