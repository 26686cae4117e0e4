// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "geometry/row_error.hpp"
#include "watchdog/floor_watch.hpp"
#include "watchdog/image_motion.hpp"
#include "watchdog/motion_fit.hpp"

namespace crane {

/// From when on what the watchdog measures is said (drifting), and from when on nothing is mapped
/// any more (wrong). Each as |value|, and only where it is several of its standard deviations.
struct WatchdogLimits {
  struct Pair {
    double drifting, wrong;
  };
  Pair height_share{0.004, 0.007};  ///< of the camera's height
  Pair tilt_rad{0.0026, 0.0052};    ///< 0.15 and 0.3 degrees
  Pair row_offset_px{0.5, 1.0};
  Pair roll_rad{0.0009, 0.0018};  ///< 0.05 and 0.1 degrees
  Pair row_slope{0.002, 0.004};   ///< one image taller than the other
  Pair scale_share{0.003, 0.006};
  Pair turn_rad{0.0013, 0.0024};  ///< 0.075 and 0.14 degrees
  Pair delay_s{0.020, 0.035};
  double jump_m = 0.03;  ///< a frame so far off the one before is not used; three in a row: wrong
};

/// What is wrong.
enum class Suspect : std::uint8_t {
  kNone,
  kHeight,    ///< the camera's height (or its focal length: with a level camera both look alike)
  kToeIn,     ///< the angle between the cameras in their common plane
  kBaseline,  ///< their distance, or the right camera's principal point
  kDepth,     ///< one of kToeIn and kBaseline: the floor's shape does not tell
  kDepthOrHeight,  ///< the crane has not moved enough to tell those apart
  kTilt,
  kRoll,       ///< of the right camera against the left one
  kRowOffset,  ///< the right camera looks too high or too low
  kRowSlope,
  kCartScale,
  kTrolleyScale,
  kCartDirection,
  kTrolleyDirection,
  kCartDelay,
  kTrolleyDelay,
  kCameraDelay,  ///< both axes alike: it is the camera's clock
  kCartJump,
  kTrolleyJump,
  kTurned,  ///< the bridge is skew, or the mount's yaw is wrong
  kMotion,  ///< images and positions disagree in a way that fits none of those
};

enum class WatchState : std::uint8_t { kFine, kDrifting, kWrong };

/// One thing that does not agree with the calibration.
struct Misfit {
  Suspect suspect = Suspect::kNone;
  WatchState state = WatchState::kFine;
  Figure figure;
};

/// In a sentence with figures and what to do.
std::string text_of(const Misfit& misfit);
/// For a metric's name or a script: "cart_scale".
const char* name_of(Suspect suspect);
/// Of rangefinders, clocks and the bridge; otherwise it is of the cameras' calibration.
bool is_of_positions(Suspect suspect);
/// Of the figure: "m", "deg", "px", "%", "ms"; the factor makes it of the SI unit.
struct ShownUnit {
  const char* unit;
  double factor;
};
ShownUnit unit_of(Suspect suspect);

/// Does the world agree with calibration and positions? Looks at every frame that is about to be
/// mapped. What is found wrong stays wrong until it is begun anew: what was mapped before was
/// placed by the same calibration. One thread; memory bounded.
class Watchdog {
 public:
  /// `height_m`: of the camera above the floor, `baseline_m`: of the pair, both as told.
  Watchdog(const WatchdogLimits& limits, double height_m, double baseline_m);

  struct Sight {
    TimeNs exposure = 0;
    Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< cart, trolley
    Eigen::Vector2d speed_mps = Eigen::Vector2d::Zero();
  };
  /// The pair's row error needs no position: of every frame, before look().
  void see_rows(const RowError& rows);
  /// True: the frame may be used. Cost: 1 to 2 ms at 1280 x 720.
  bool look(const DepthFrame& frame, const Sight& sight);

  [[nodiscard]] WatchState state() const { return state_; }
  /// What weighs most; kNone when all is fine.
  [[nodiscard]] const Misfit& worst() const { return worst_; }
  [[nodiscard]] const FloorWatch::Finding& floor() const { return floor_.finding(); }
  [[nodiscard]] const std::array<AxisFit, 2>& motion() const { return fits_; }
  [[nodiscard]] const RowError& rows() const { return rows_; }
  [[nodiscard]] std::size_t motion_samples() const { return samples_.size(); }
  /// Positions and times to come have nothing to do with those before.
  void begin_anew();

 private:
  bool follow(const DepthFrame& frame, const Sight& sight);
  void keep(const MotionSample& sample);
  [[nodiscard]] bool jumps(const MotionSample& sample);
  void judge_rows();
  void judge_height();
  void judge_motion();
  [[nodiscard]] bool long_enough_to_judge() const;
  void settle();
  void judge();
  void judge_pending();
  void consider(Suspect suspect, const Figure& figure, const WatchdogLimits::Pair& limits,
                double least_sigmas);

  WatchdogLimits limits_;
  double height_m_, baseline_m_;
  FloorWatch floor_;
  ImageMotion images_;
  FrameView view_;
  RowError rows_;  ///< mean of the last ones
  int row_frames_ = 0;
  std::vector<MotionSample> samples_, pending_;
  Eigen::Vector2d key_off_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d key_place_m_ = Eigen::Vector2d::Zero();
  std::array<AxisFit, 2> fits_;
  double usual_change_m_ = 0.001;  ///< of off_m from frame to frame
  Eigen::Vector2d image_speed_mps_ = Eigen::Vector2d::Zero();
  std::optional<MotionSample> last_;  ///< that was measured
  double depth_sigma_share_ = 0;
  double depth_share_ = 0;  ///< what a wrong depth makes of both scales
  std::vector<Misfit> found_;
  std::optional<Misfit> jumped_;
  WatchState state_ = WatchState::kFine;
  Misfit worst_;
};

struct WatchFigure {
  const char* name;  ///< ends in its unit
  Figure figure;
};
/// All that is known, with standard deviations.
std::vector<WatchFigure> figures_of(const Watchdog& watchdog);

}  // namespace crane
