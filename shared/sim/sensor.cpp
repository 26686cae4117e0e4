// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace crane {
namespace {

float to_srgb(float linear) {
  const float c = std::clamp(linear, 0.0F, 1.0F);
  return c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1 / 2.4F) - 0.055F;
}

}  // namespace

Sensor::Sensor(const SceneCamera& camera, bool left, std::uint64_t seed)
    : camera_(camera), model_(left ? camera.rig.left : camera.rig.right) {
  const std::uint64_t own = mix(seed * 2 + (left ? 1 : 0) + 77);
  dust_ = spots(camera.dust, camera.dust_radius_px, own);
  drops_ = spots(camera.drops, camera.drop_radius_px, own + 1'000'000);
}

std::vector<Sensor::Spot> Sensor::spots(int count, double radius, std::uint64_t seed) const {
  std::vector<Spot> out;
  for (int i = 0; i < count; ++i) {
    const std::uint64_t at = seed + 3 * static_cast<std::uint64_t>(i);
    out.push_back({uniform(at) * float(model_.width), uniform(at + 1) * float(model_.height),
                   float(radius) * (0.5F + uniform(at + 2))});
  }
  return out;
}

Eigen::Vector2f Sensor::looks_at(float u, float v) const {
  for (const Spot& drop : drops_) {
    const float du = u - drop.u, dv = v - drop.v;
    // A drop is a strong lens: it shows its surroundings small and upside down.
    constexpr float kReach = -3;
    if (du * du + dv * dv < drop.radius * drop.radius)
      return {drop.u + kReach * du, drop.v + kReach * dv};
  }
  return {u, v};
}

float Sensor::gain_at(std::uint32_t u, std::uint32_t v) const {
  float gain = 1;
  if (camera_.vignette > 0) {
    const float x = (float(u) - 0.5F * float(model_.width - 1)) / (0.5F * float(model_.width));
    const float y = (float(v) - 0.5F * float(model_.height - 1)) / (0.5F * float(model_.height));
    gain = 1 - float(camera_.vignette) * std::min(1.0F, (x * x + y * y) / 2);
  }
  for (const Spot& speck : dust_) {  // far out of focus: it fades to its rim
    const float distance2 =
        (float(u) - speck.u) * (float(u) - speck.u) + (float(v) - speck.v) * (float(v) - speck.v);
    const float share = distance2 / (speck.radius * speck.radius);
    if (share < 1) gain *= 1 - float(camera_.dust_dark) * (1 - share);
  }
  return gain;
}

int Sensor::level(float linear, std::uint64_t random) const {
  const float white = camera_.bits == 12 ? 4095.0F : 255.0F;
  float grey = 0;
  if (camera_.full_well_e > 0) {
    const float full = float(camera_.full_well_e);
    const float electrons = std::clamp(linear, 0.0F, 1.0F) * full;
    const float read = float(camera_.read_noise_e);
    const float counted = electrons + std::sqrt(electrons + read * read) * gaussian(random);
    grey = white * to_srgb(counted / full * float(camera_.gain));
  } else {
    grey = white * to_srgb(linear) + white / 255 * float(camera_.noise_grey) * gaussian(random);
  }
  return static_cast<int>(std::clamp(std::lround(grey), 0L, static_cast<long>(white)));
}

}  // namespace crane
