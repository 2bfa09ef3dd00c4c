#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The loops of the kernel files are really vectorised: in the machine code of every function of every
# *_simd.c with more than a few scalar sums and products there is packed arithmetic in the registers of
# its instruction set, more than an eighth as much (the end of a loop may be seven scalar turns), and the object as a
# whole has packed roots and fused multiply-adds. A flag in the wrong place costs a factor of 8 and no
# warning: see src/hd.h.
set -u
build=${TEPHRA_BUILD:-build}
command -v objdump >/dev/null || { echo "objdump is not at hand"; exit 77; }
ls "$build"/*/libkernels_v4_a-*_simd.o >/dev/null 2>&1 || { echo "no kernel objects in $build"; exit 77; }
if nm "$build"/*/libkernels_v4_a-*_simd.o | grep -q __asan; then echo "a debug build"; exit 77; fi

# check OBJECT REGISTERS: counts packed arithmetic in such registers, and scalar arithmetic, by function.
check() {
    objdump -d --no-show-raw-insn "$1" | awk -v object="${1##*/}" -v wide="$2" -v few=12 '
        /^[0-9a-f]+ <.*>:$/ { name = $2; known[name] = 1 }
        $2 ~ /^v?r?sqrt[0-9]*p[sd]$/ && $0 ~ wide { root++ }
        $2 ~ /^v?r?sqrt[0-9]*s[sd]$/ { scalar_root++ }
        $2 ~ /^vfn?m(add|sub)[0-9]*p[sd]$/ && $0 ~ wide { fused++ }
        $2 ~ /^(vfn?m(add|sub)[0-9]*|v?(mul|add|sub))p[sd]$/ && $0 ~ wide { packed[name]++; all_packed++ }
        $2 ~ /^(vfn?m(add|sub)[0-9]*|v?(mul|add|sub))s[sd]$/ { scalar[name]++; all_scalar++ }
        END {
            printf "%-32s packed in %-11s: %4d roots, %4d fused of %4d; scalar: %d roots, %d of the rest\n",
                object, wide, root, fused, all_packed, scalar_root, all_scalar
            bad = !((root > 0 || scalar_root == 0) && (wide == "xmm" || fused > 0))
            for (name in known)
                if (scalar[name] >= few && 8 * packed[name] <= scalar[name]) {
                    printf "%s %s %d packed, %d scalar\n", object, name, packed[name], scalar[name]
                    bad = 1
                }
            exit bad
        }' || { echo "not vectorised: $1"; failed=1; }
}

failed=0
for object in "$build"/*/libkernels_v4_a-*_simd.o; do check "$object" "[yz]mm"; done
for object in "$build"/*/libkernels_v3_a-*_simd.o; do check "$object" ymm; done
for object in "$build"/*/libkernels_v2_a-*_simd.o; do check "$object" xmm; done
exit $failed
