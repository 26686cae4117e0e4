#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace crane {

// Numbers from a seed that are the same on every machine.

std::uint64_t mix(std::uint64_t h);
/// 0..1, the same for the same number everywhere.
float uniform(std::uint64_t h);
/// Of mean 0 and standard deviation 1.
float gaussian(std::uint64_t h);
/// Noise in space of three octaves, the coarsest of `grain_m`; -1..1.
float texture(const Eigen::Vector3f& p, float grain_m, std::uint64_t seed);

}  // namespace crane
