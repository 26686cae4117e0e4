// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "sim/meshes.hpp"
#include "sim/scene.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace crane {

/// What a scene shows to a ray (Embree): shapes with their surfaces, under its lamps and daylight.
/// Reading it is thread-safe.
class LitScene {
 public:
  explicit LitScene(const Scene& scene);
  ~LitScene();
  LitScene(const LitScene&) = delete;
  LitScene& operator=(const LitScene&) = delete;

  [[nodiscard]] const Scene& scene() const { return scene_; }
  /// What stands and hangs there from now on; each keeps its place in the list.
  void show(const std::vector<std::optional<SceneObstacle>>& obstacles);

  static constexpr float kFar = std::numeric_limits<float>::infinity();
  struct Hit {
    float distance = kFar;  ///< in lengths of the direction
    Eigen::Vector3f normal{0, 0, 1};
    unsigned id = 0;
  };
  [[nodiscard]] Hit trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  /// Whether anything that lets no light through lies between two points.
  [[nodiscard]] bool blocked(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const;
  /// Light that comes to the eye from a direction, by way of mirrors and through glass, which
  /// `depth` counts. Linear.
  [[nodiscard]] Eigen::Vector3f look(const Eigen::Vector3f& eye, const Eigen::Vector3f& direction,
                                     double seconds, int depth = 0) const;

 private:
  void add(const Mesh& mesh, const Material& material, unsigned id);
  [[nodiscard]] bool blocked_by_opaque(Eigen::Vector3f from, const Eigen::Vector3f& way) const;
  [[nodiscard]] Eigen::Vector3f ceiling(const Eigen::Vector3f& eye,
                                        const Eigen::Vector3f& direction, double seconds) const;
  static bool is_on(const Lamp& lamp, double seconds);
  [[nodiscard]] double ambient(double seconds) const;
  [[nodiscard]] Eigen::Vector3f shade(const Eigen::Vector3f& p, const Eigen::Vector3f& to_eye,
                                      const Hit& hit, double seconds) const;

  Scene scene_;
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* geometry_ = nullptr;
  std::map<unsigned, const Material*> materials_;  ///< by Embree geometry id
  std::map<unsigned, Eigen::Vector3f> origins_;    ///< of textures that moved, likewise
  bool any_glass_ = false;
};

}  // namespace crane
