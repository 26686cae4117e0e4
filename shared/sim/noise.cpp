#include "sim/noise.hpp"

#include <algorithm>
#include <cmath>

namespace crane {

std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
  return h ^ (h >> 31U);
}

float uniform(std::uint64_t h) {
  return float(mix(h) >> 40U) * (1.0F / 16'777'216.0F);
}

/// Box-Muller; one value is enough.
float gaussian(std::uint64_t h) {
  const float u = std::max(uniform(h), 1e-7F);
  return std::sqrt(-2 * std::log(u)) * std::cos(6.2831853F * uniform(h ^ 0x9E3779B97F4A7C15ULL));
}

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
