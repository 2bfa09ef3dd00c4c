/* SPDX-License-Identifier: GPL-3.0-or-later
 * CUB, the toolkit's library of sorts and scans, as .cu files name it: this header, or its part in tests/shim/launch.cuh. */
#ifndef TEPHRA_CUB_CUH
#define TEPHRA_CUB_CUH
/* Headers of CUB include <iostream> and use no stream of it; its static object would need libstdc++ where the program is
 * linked. With the guard of libstdc++'s header defined it is left out. */
#include <ostream>
#define _GLIBCXX_IOSTREAM 1
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#endif
