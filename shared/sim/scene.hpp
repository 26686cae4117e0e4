// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"
#include "recording/image_file.hpp"
#include "recording/truth.hpp"
#include "sim/faults.hpp"

namespace crane {

/// How a surface looks. Texture is a seeded noise in the solid, so it moves with nothing.
struct Material {
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< linear, 0..1, red green blue
  double texture = 0.5;                      ///< contrast, 0 = textureless .. 1
  double grain_m = 0.01;                     ///< size of the coarsest grain
  double gloss = 0;                          ///< strength of highlights, 0..1
  double shininess = 60;                     ///< sharpness of highlights
  double mirror = 0, glass = 0;              ///< shares of the light reflected, let through
  enum class Pattern { kNone, kChecker, kGrating, kStripesX, kStripesY, kBricks, kDots };
  Pattern pattern = Pattern::kNone;  ///< exactly periodic, in map coordinates
  double period_m = 0.1;
  double pattern_dark = 0.4;  ///< factor on the colour where the pattern is dark
  /// A photograph over the surface instead of a colour, tile by tile of `photo_m` [m] width.
  std::shared_ptr<const Image> photo;
  double photo_m = 1;
};

/// A rectangle that shines down, centre and size [m].
struct Lamp {
  Eigen::Vector3d centre{0, 0, 4};
  double size_x_m = 0.4, size_y_m = 0.4;
  double power = 1;
  double from_s = 0, until_s = std::numeric_limits<double>::infinity();  ///< it is on
};

/// Light from the windows: the ambient light swells and fades.
struct Daylight {
  double swing = 0;  ///< share of the ambient light
  double period_s = 60;
};

struct SceneObstacle {
  TrueObstacle shape;
  std::string material;
  double base_m = 0;  ///< height of its lower side
  double from_s = 0, until_s = std::numeric_limits<double>::infinity();  ///< it is there
  struct Step {
    double time_s = 0, x_m = 0, y_m = 0;
  };
  std::vector<Step> track;  ///< where its middle is, straight in between; empty: it stands
  Eigen::Vector3f texture_origin = Eigen::Vector3f::Zero();  ///< its texture moves along
};

/// A rectangular hole in the floor.
struct ScenePit {
  double x0_m = 0, y0_m = 0, x1_m = 0, y1_m = 0, depth_m = 1;
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
  int samples = 2;            ///< rays a pixel
  double exposure_right = 1;  ///< factor on the light of the right camera alone
  double vignette = 0;        ///< share of the light lost in the corners
  double exposure_s = 0;      ///< how long a pixel collects light: motion blurs
  double readout_s = 0;       ///< from the first row to the last: rolling shutter
  /// Electrons of a white pixel: light arrives in quanta, and reading adds its own noise, instead
  /// of noise_grey; 0 = off. `gain` comes after both.
  double full_well_e = 0, read_noise_e = 5, gain = 1;
  int bits = 8;                                 ///< or 12, in 16-bit PNG files without colour
  int dust = 0, drops = 0;                      ///< specks and water drops on each lens
  double dust_radius_px = 25, dust_dark = 0.6;  ///< share of the light that a speck takes
  double drop_radius_px = 40;
};

/// How the camera really moves while cart and trolley do what they are told to: nobody says.
struct UntoldMotion {
  double skew_deg = 0, skew_deg_per_m = 0;  ///< turn about z, and by metre of the trolley
  double sway_roll_deg = 0, sway_pitch_deg = 0, sway_period_s = 3;
  double vibration_deg = 0, vibration_m = 0, vibration_hz = 12;
  [[nodiscard]] bool any() const {
    return skew_deg != 0 || skew_deg_per_m != 0 || sway_roll_deg != 0 || sway_pitch_deg != 0 ||
           vibration_deg != 0 || vibration_m != 0;
  }
};

struct SceneRangefinder {
  double sigma_m = 0.001;  ///< +-3 mm is three of them
  double rate_hz = 20;
  double delay_ms = 0;  ///< a reading is stamped this much later than it was true
  /// The cart has two, one a rail: at map y rail_y_m and rail_span_m further; 0 = there is one, and
  /// it measures where the trolley is.
  double rail_y_m = 0, rail_span_m = 0;
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
  double repeat_s = 0;  ///< after so long all that has its times begins anew; 0 = never
};

/// What a map of the scene must keep. See shared/sim/scenes/workshop/README.md.
struct SceneBound {
  struct Limits {
    std::string obstacle;                       ///< empty: the whole map
    std::map<std::string, double> least, most;  ///< by quantity
  };
  std::vector<Limits> limits;
};

/// The small version of a scene, for quick tests: a part of the image, the first frames.
struct SceneQuick {
  std::uint32_t width = 0, height = 0;  ///< [px] 0 = there is none
  std::size_t frames = 0;
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
  Daylight daylight;
  std::vector<Lamp> lamps;
  std::vector<SceneObstacle> obstacles;
  std::vector<ScenePit> pits;
  std::optional<SceneHoist> hoist;
  UntoldMotion untold;
  std::vector<Fault> faults;  ///< of what is written, not of what is rendered
  SceneBound bound;
  SceneQuick quick;
};

/// Since the round began that is on at a time since the start, where rounds are repeated.
double within_round(const SceneMotion& motion, double seconds);

/// Cart and trolley at a time since the start.
Eigen::Vector2d gantry_at(const SceneMotion& motion, double seconds);

/// What the mount does that nobody says, as a motion of the map frame; the identity when nothing.
Eigen::Isometry3d untold_at(const UntoldMotion& motion, const Eigen::Vector2d& gantry,
                            double seconds);

/// Hook and load at a time since the round began.
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

/// The small version: the middle of the image, so that a pixel sees as much as before.
Scene make_quick(Scene scene);

}  // namespace crane
