#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The pair loops of the kernel files are really vectorised: every object of a *_simd.c that computes
# reciprocal roots does so packed, in the widest registers of its instruction set, with fused
# multiply-adds, and more often packed than scalar. (A flag in the wrong place costs a factor of 8
# and no warning: see src/hd.h.)
set -u
build=${TEPHRA_BUILD:-build}
command -v objdump >/dev/null || { echo "objdump is not at hand"; exit 77; }
ls "$build"/*/libkernels_v4_a-*_simd.o >/dev/null 2>&1 || { echo "no kernel objects in $build"; exit 77; }
if nm "$build"/*/libkernels_v4_a-*_simd.o | grep -q __asan; then echo "a debug build"; exit 77; fi

# check OBJECT REGISTERS: counts packed and scalar arithmetic in the object's code.
check() {
    objdump -d --no-show-raw-insn "$1" | awk -v object="${1##*/}" -v wide="$2" '
        $2 ~ /^v?(rsqrt|sqrt)[0-9]*ps$/ && index($0, wide) { root++ }
        $2 ~ /^v?(rsqrt|sqrt)[0-9]*ss$/ { scalar_root++ }
        $2 ~ /^vf(n?m(add|sub))[0-9]*ps$/ && index($0, wide) { fused++ }
        $2 ~ /^v?mulps$/ && index($0, wide) { product++ }
        $2 ~ /^(vf(n?m(add|sub))[0-9]*|v?mul)ss$/ { scalar++ }
        END {
            printf "%-36s %s: %d packed roots, %d packed fused, %d packed products; scalar: %d roots, %d products\n",
                object, wide, root, fused, product, scalar_root, scalar
            if (root + scalar_root == 0 && fused + product >= scalar) exit 0
            exit !(root > 0 && root >= scalar_root && fused + product > scalar && (wide == "xmm" || fused > 0))
        }' || { echo "not vectorised: $1"; failed=1; }
}

failed=0
for object in "$build"/*/libkernels_v4_a-*_simd.o; do check "$object" zmm; done
for object in "$build"/*/libkernels_v3_a-*_simd.o; do check "$object" ymm; done
for object in "$build"/*/libkernels_v2_a-*_simd.o; do check "$object" xmm; done
exit $failed
