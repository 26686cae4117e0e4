#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
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
  double from_s = 0, until_s = std::numeric_limits<double>::infinity();  ///< it is there
};

/// Hook and load below the trolley, and what the crane's controller says of them.
struct SceneHoist {
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  ///< hook at rest minus (cart, trolley)
  double rope_top_m = 2, rope_radius_m = 0.01;
  Eigen::Vector3d hook_size_m{0.1, 0.1, 0.15};
  std::string material;  ///< of rope and hook
  Eigen::Vector3d load_size_m{0, 0, 0};
  double load_yaw_rad = 0, sling_m = 0.1;
  std::string load_material;
  double sway_m = 0, sway_period_s = 3;  ///< along map x
  double rate_hz = 10;                   ///< of hoist_state
  struct Move {
    double time_s = 0, hook_m = 1;  ///< height of the hook's lowest point; straight in between
    bool load = false;              ///< from here on
  };
  std::vector<Move> moves;
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
  std::vector<double> times_s;          ///< when they are reached; empty: by speed_mps
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
  std::optional<SceneHoist> hoist;
};

/// Cart and trolley at a time since the start.
Eigen::Vector2d gantry_at(const SceneMotion& motion, double seconds);

/// Hook and load at a time since the start.
struct HoistPose {
  double hook_m = 0;
  bool load = false;
  Eigen::Vector2d sway_m = Eigen::Vector2d::Zero();
};
HoistPose hoist_at(const SceneHoist& hoist, double seconds);

/// What stands and hangs there at a time since the start: obstacles, then rope, hook and load.
/// What is not there is nothing, so that each thing keeps its place and its texture.
std::vector<std::optional<SceneObstacle>> obstacles_at(const Scene& scene, double seconds);

/// Error: Configuration with every problem of the file and its line.
Result<Scene> read_scene(const std::string& path);

}  // namespace crane
