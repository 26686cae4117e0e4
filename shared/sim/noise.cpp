// SPDX-License-Identifier: Apache-2.0
#include "sim/noise.hpp"

#include <algorithm>

namespace crane {

namespace {

float lattice(int x, int y, int z, std::uint64_t seed) {
  return uniform(seed + std::uint64_t(std::uint32_t(x)) * 0x8DA6B343ULL +
                 std::uint64_t(std::uint32_t(y)) * 0xD8163841ULL * 65'537ULL +
                 std::uint64_t(std::uint32_t(z)) * 0xCB1AB31FULL * 257ULL);
}

/// Smoothly interpolated noise, 0..1.
float value_noise(const Eigen::Vector3f& p, std::uint64_t seed) {
  const Eigen::Vector3f base = p.array().floor();
  const Eigen::Vector3f f = p - base;
  const Eigen::Vector3f s = f.array() * f.array() * (3.0F - 2.0F * f.array());
  const int x = int(base.x());
  const int y = int(base.y());
  const int z = int(base.z());
  const auto line = [&](int dy, int dz) {
    const float a = lattice(x, y + dy, z + dz, seed);
    return a + s.x() * (lattice(x + 1, y + dy, z + dz, seed) - a);
  };
  const auto plane = [&](int dz) {
    const float a = line(0, dz);
    return a + s.y() * (line(1, dz) - a);
  };
  const float a = plane(0);
  return a + s.z() * (plane(1) - a);
}

}  // namespace

float texture(const Eigen::Vector3f& p, float grain_m, std::uint64_t seed) {
  float sum = 0;
  float weight = 1;
  float scale = 1 / grain_m;
  for (int octave = 0; octave < 3; ++octave) {
    sum += weight * (2 * value_noise(p * scale, seed + std::uint64_t(octave) * 7919) - 1);
    weight *= 0.6F;
    scale *= 2.1F;
  }
  return std::clamp(sum, -1.0F, 1.0F);
}

}  // namespace crane
