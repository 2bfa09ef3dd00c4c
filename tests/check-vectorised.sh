#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The pair loops of the kernel files are really vectorised: in the machine code of every *_simd.c
# there are packed roots and fused multiply-adds in the registers of its instruction set, and not four
# times as much scalar arithmetic (the ends of loops are scalar). A flag in the wrong place costs a
# factor of 8 and no warning: see src/hd.h.
set -u
build=${TEPHRA_BUILD:-build}
command -v objdump >/dev/null || { echo "objdump is not at hand"; exit 77; }
ls "$build"/*/libkernels_v4_a-*_simd.o >/dev/null 2>&1 || { echo "no kernel objects in $build"; exit 77; }
if nm "$build"/*/libkernels_v4_a-*_simd.o | grep -q __asan; then echo "a debug build"; exit 77; fi

# check OBJECT REGISTERS: counts packed arithmetic in such registers, and scalar arithmetic.
check() {
    objdump -d --no-show-raw-insn "$1" | awk -v object="${1##*/}" -v wide="$2" '
        $2 ~ /^v?r?sqrt[0-9]*p[sd]$/ && $0 ~ wide { root++ }
        $2 ~ /^v?r?sqrt[0-9]*s[sd]$/ { scalar_root++ }
        $2 ~ /^vfn?m(add|sub)[0-9]*p[sd]$/ && $0 ~ wide { fused++ }
        $2 ~ /^v?mulp[sd]$/ && $0 ~ wide { product++ }
        $2 ~ /^(vfn?m(add|sub)[0-9]*|v?mul)s[sd]$/ { scalar++ }
        END {
            printf "%-32s packed in %-11s: %4d roots, %4d fused, %4d products; scalar: %d roots, %d products\n",
                object, wide, root, fused, product, scalar_root, scalar
            exit !((root > 0 || scalar_root == 0) && 4 * (fused + product) > scalar && (wide == "xmm" || fused > 0))
        }' || { echo "not vectorised: $1"; failed=1; }
}

failed=0
for object in "$build"/*/libkernels_v4_a-*_simd.o; do check "$object" "[yz]mm"; done
for object in "$build"/*/libkernels_v3_a-*_simd.o; do check "$object" ymm; done
for object in "$build"/*/libkernels_v2_a-*_simd.o; do check "$object" xmm; done
exit $failed
