// SPDX-License-Identifier: Apache-2.0
#pragma once

// For which instruction sets Highway compiles a file: from SSE4 (every PC since 2008) or NEON
// upwards; wider than 32 bytes would not be used. Before <hwy/foreach_target.h>.
#define HWY_DISABLED_TARGETS \
  (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_AVX3 | HWY_AVX3_DL)
#if defined(__x86_64__)
#define HWY_BASELINE_TARGETS HWY_SSE4
#endif
