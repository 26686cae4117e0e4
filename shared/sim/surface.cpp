// SPDX-License-Identifier: Apache-2.0
#include "sim/surface.hpp"

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace crane {
namespace {

using Eigen::Vector3f;
using Pattern = Material::Pattern;

float fraction(float v) {
  return v - std::floor(v);
}

bool odd(float v) {
  return (static_cast<int>(std::floor(v)) & 1) != 0;
}

bool is_dark(Pattern pattern, const Vector3f& p) {  // p in periods
  constexpr float kBar = 0.25F;                     // of a grating: its bright share
  constexpr float kJoint = 0.06F;
  switch (pattern) {
    case Pattern::kNone:
      return false;
    case Pattern::kChecker:
      return (odd(p.x()) != odd(p.y())) != odd(p.z() + 0.01F);
    case Pattern::kGrating:
      return fraction(p.x()) > kBar && fraction(p.y()) > kBar;
    case Pattern::kStripesX:
      return fraction(p.x()) < 0.5F;
    case Pattern::kStripesY:
      return fraction(p.y()) < 0.5F;
    case Pattern::kBricks: {
      const float row = 2 * p.y();
      return fraction(row) < 2 * kJoint || fraction(p.x() + (odd(row) ? 0.5F : 0)) < kJoint;
    }
    case Pattern::kDots:
      return std::hypot(fraction(p.x()) - 0.5F, fraction(p.y()) - 0.5F) < 0.25F;
  }
  return false;
}

float to_linear(float grey) {
  return grey <= 0.04045F ? grey / 12.92F : std::pow((grey + 0.055F) / 1.055F, 2.4F);
}

/// Bilinear, repeated in both directions; u to the right, v down, in pixels.
Vector3f photo_at(const Image& photo, float u, float v) {
  const auto pixel = [&](int x, int y) {
    const int width = int(photo.width), height = int(photo.height);
    x = (x % width + width) % width;
    y = (y % height + height) % height;
    const std::uint8_t* p =
        photo.bytes.data() + (std::size_t(y) * photo.width + std::size_t(x)) * photo.channels;
    const bool colour = photo.channels == 3;
    return Vector3f(to_linear(float(p[colour ? 2 : 0]) / 255),
                    to_linear(float(p[colour ? 1 : 0]) / 255), to_linear(float(p[0]) / 255));
  };
  const int x = int(std::floor(u)), y = int(std::floor(v));
  const float fx = fraction(u), fy = fraction(v);
  return (1 - fy) * ((1 - fx) * pixel(x, y) + fx * pixel(x + 1, y)) +
         fy * ((1 - fx) * pixel(x, y + 1) + fx * pixel(x + 1, y + 1));
}

/// The photograph lies flat on a surface: on the floor as seen from above, north up.
Vector3f photo_on(const Material& m, const Vector3f& p, const Vector3f& normal) {
  const Vector3f n = normal.cwiseAbs();
  const float along = n.z() >= n.x() || n.y() >= n.x() ? p.x() : p.y();
  const float up = n.z() >= n.x() && n.z() >= n.y() ? p.y() : p.z();
  const float scale = float(m.photo->width) / float(m.photo_m);
  return photo_at(*m.photo, along * scale, -up * scale);
}

}  // namespace

Vector3f albedo_at(const Material& m, const Vector3f& p, const Vector3f& normal,
                   std::uint64_t seed) {
  Vector3f albedo = m.photo != nullptr ? photo_on(m, p, normal) : m.colour;
  if (m.texture > 0) albedo *= 1 + float(m.texture) * texture(p, float(m.grain_m), seed);
  if (m.pattern != Pattern::kNone && is_dark(m.pattern, p / float(m.period_m)))
    albedo *= float(m.pattern_dark);
  return albedo.cwiseMax(0.005F);
}

}  // namespace crane
