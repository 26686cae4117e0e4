#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"
#include "recording/truth.hpp"

namespace crane {

/// How a surface looks. Texture is a seeded noise in the solid, so it moves with nothing.
struct Material {
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< linear, 0..1, red green blue
  double texture = 0.5;                      ///< contrast, 0 = textureless .. 1
  double grain_m = 0.01;                     ///< size of the coarsest grain
  double gloss = 0;                          ///< strength of highlights, 0..1
  double shininess = 60;                     ///< sharpness of highlights
};

/// A rectangle that shines down, centre and size [m].
struct Lamp {
  Eigen::Vector3d centre{0, 0, 4};
  double size_x_m = 0.4, size_y_m = 0.4;
  double power = 1;
};

struct SceneObstacle {
  TrueObstacle shape;
  std::string material;
  double base_m = 0;  ///< height of its lower side
};

struct SceneCamera {
  StereoRig rig;
  double exposure = 1;      ///< factor on all light
  double noise_grey = 1.5;  ///< standard deviation of the sensor, grey levels
  bool colour = true;
  int samples = 2;  ///< rays a pixel
};

struct SceneRangefinder {
  double sigma_m = 0.001;  ///< +-3 mm is three of them
  double rate_hz = 20;
  double delay_ms = 0;  ///< a reading is stamped this much later than it was true
};

/// Where cart and trolley are, and when images are taken.
struct SceneMotion {
  std::vector<Eigen::Vector2d> points;  ///< cart, trolley [m]
  bool continuous = false;              ///< false: one image at each point, standing still
  double interval_s = 1;                ///< standing still: from image to image
  double speed_mps = 0.1;               ///< continuous: along the points, over and over
  double rate_hz = 10;
  double duration_s = 60;
};

struct Scene {
  std::string name;
  std::uint64_t seed = 1;
  SceneCamera camera;
  SceneRangefinder rangefinder;
  SceneMotion motion;
  std::map<std::string, Material> materials;
  std::string floor_material;
  double ambient = 0.25;
  std::vector<Lamp> lamps;
  std::vector<SceneObstacle> obstacles;
};

/// Error: Configuration with every problem of the file and its line.
Result<Scene> read_scene(const std::string& path);

}  // namespace crane
