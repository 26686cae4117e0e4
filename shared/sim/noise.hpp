// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace crane {

// Numbers from a seed that are the same on every machine.

inline std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
  return h ^ (h >> 31U);
}

/// 0..1, the same for the same number everywhere.
inline float uniform(std::uint64_t h) {
  return float(mix(h) >> 40U) * (1.0F / 16'777'216.0F);
}

/// Of mean 0 and standard deviation 1: Box-Muller; one value is enough.
inline float gaussian(std::uint64_t h) {
  const float u = std::max(uniform(h), 1e-7F);
  return std::sqrt(-2 * std::log(u)) * std::cos(6.2831853F * uniform(h ^ 0x9E3779B97F4A7C15ULL));
}

/// Noise in space of three octaves, the coarsest of `grain_m`; -1..1.
float texture(const Eigen::Vector3f& p, float grain_m, std::uint64_t seed);

}  // namespace crane
