// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "recording/image_file.hpp"
#include "sim/scene.hpp"

namespace crane {

/// Ray-traces a scene (Embree): direct light of area lamps with shadows and highlights; textured,
/// patterned, glossy or textureless surfaces, mirrors and glass; lens distortion, dirt, motion
/// blur, rolling shutter, sensor noise. The same scene and seed give the same image. Uses all
/// cores; calls from one thread.
class Renderer {
 public:
  explicit Renderer(const Scene& scene);
  ~Renderer();
  Renderer(Renderer&&) noexcept;

  /// What stands and hangs in the scene from now on; each keeps its place in the list.
  void show(const std::vector<std::optional<SceneObstacle>>& obstacles);

  /// One camera's image. `frame` seeds the sensor noise; `seconds` since the start: lamps,
  /// daylight and motion that nobody tells follow it, what stands there does not (see show()).
  Image render(bool left, double cart_m, double trolley_m, std::uint64_t frame,
               double seconds = 0) const;
  /// The same of a camera of 12 bits: grey values 0 .. 4095.
  std::vector<std::uint16_t> render_deep(bool left, double cart_m, double trolley_m,
                                         std::uint64_t frame, double seconds = 0) const;
  /// Depth along the view axis of the left image's pixel centres [m]; 0 = nothing hit.
  std::vector<float> depth(double cart_m, double trolley_m, double seconds = 0) const;
  /// Highest surface at map points; from above.
  [[nodiscard]] double height_m(double x_m, double y_m) const;
  /// Whether the left camera sees this point from here.
  [[nodiscard]] bool sees(double cart_m, double trolley_m, const Eigen::Vector3d& p_map) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
