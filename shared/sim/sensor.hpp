// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sim/scene.hpp"

namespace crane {

/// What lies between the light that arrives and the numbers that are recorded: dirt on the lens,
/// vignetting, exposure, noise, quantisation. One for each camera of a pair.
class Sensor {
 public:
  Sensor(const SceneCamera& camera, bool left, std::uint64_t seed);

  /// Where a pixel's ray really goes: through a drop it is bent. In pixels.
  [[nodiscard]] Eigen::Vector2f looks_at(float u, float v) const;
  /// Share of the light that gets through lens and dirt to a pixel.
  [[nodiscard]] float gain_at(std::uint32_t u, std::uint32_t v) const;
  /// Whether looks_at() or gain_at() do anything.
  [[nodiscard]] bool bends() const { return !drops_.empty(); }
  [[nodiscard]] bool dims() const { return !dust_.empty() || camera_.vignette > 0; }

  /// Grey level of linear light, 0 .. 255 or 4095, with the noise of `random`.
  [[nodiscard]] int level(float linear, std::uint64_t random) const;

 private:
  struct Spot {
    float u = 0, v = 0, radius = 1;
  };
  [[nodiscard]] std::vector<Spot> spots(int count, double radius, std::uint64_t seed) const;

  SceneCamera camera_;
  CameraModel model_;
  std::vector<Spot> dust_, drops_;
};

}  // namespace crane
