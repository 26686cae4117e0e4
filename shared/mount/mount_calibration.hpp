// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "config/mapper_config.hpp"
#include "config/rangefinder_config.hpp"
#include "mount/drive.hpp"

namespace crane {

/// A thing of known height on the floor: a check, never part of the fit.
struct FloorTarget {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< of its middle, in the map
  double height_m = 0;
};
/// "X,Y,H". Error: Configuration.
Result<FloorTarget> parse_floor_target(const std::string& text);

struct MountOptions {
  /// How positions are read until now; what is not determined stays as it is here.
  MapperConfig told;
  /// Which way map x grows: 1, with the bridge's readings; -1, against them. Nothing: as the told
  /// camera says, whose image is taken to be turned by less than a quarter.
  std::optional<int> cart_direction;
  /// Where bridge and trolley stood when the recording began [m, map]: gives the offsets.
  std::optional<Eigen::Vector2d> start_m;
  /// Height of the hook's lowest point above the floor [m], all the while: gives its rest position.
  std::optional<double> hook_height_m;
  std::vector<FloorTarget> targets;
};

/// What is estimated, in the order of files and reports. Of each rangefinder its own.
enum class MountItem : std::uint8_t {
  kHeight,            ///< of the camera above the floor at the middle of the drive [m]
  kTiltX,             ///< the camera looks so far towards map +x from straight down [deg]
  kTiltY,             ///< likewise +y
  kYaw,               ///< the image's x axis points so far from map x, about map z [deg]
  kCartDirection,     ///< 1 or -1
  kTrolleyDirection,  ///< 1 or -1
  kCartScale,         ///< readings are to be multiplied by
  kTrolleyScale,
  kCartLatency,  ///< readings are stamped so much later than images [ms]
  kTrolleyLatency,
  kCartOffset,  ///< map coordinate of a reading of 0 [m]
  kTrolleyOffset,
  kSkew,              ///< the bridge stands so far from square to the runway, about map z [deg]
  kCartSecondOffset,  ///< of the second rangefinder of the bridge [m]: skew zero
  kFloorSlopeX,       ///< the floor rises so much along map x against the rails [deg]
  kFloorSlopeY,
  kHookX,  ///< where the hook hangs at rest, from the bridge's coordinate [m]
  kHookY,
};
inline constexpr std::size_t kMountItems = 18;

/// How an item is written: "height_m", and for people.
struct MountItemName {
  const char* key;   ///< ends in its unit
  const char* what;  ///< in the words of the trade
  const char* unit;  ///< "" where it has none
  int decimals;      ///< of its value for people
};
const MountItemName& name_of(MountItem item);

/// One item: value and standard deviation, or why there is none.
struct MountValue {
  MountItem item = MountItem::kHeight;
  bool determined = false;
  double value = 0, sigma = 0;  ///< of no meaning unless determined; in the item's unit
  std::string why_not;          ///< and what to do; empty if determined
};

/// What a target of known height says of the result.
struct TargetCheck {
  FloorTarget target;
  bool seen = false;    ///< enough points on its top
  double height_m = 0;  ///< as measured
  double sigma_m = 0;   ///< of that
  bool agrees = false;  ///< within three sigma and 2 cm, or 1 % of the camera's height
};

enum class MountVerdict { kGood, kUsable, kBad };

/// Facts of the drive, for reports.
struct DriveFacts {
  double seconds = 0;
  std::size_t frames = 0, tracks = 0, floor_tracks = 0, moving_with_camera = 0,
              moving_by_itself = 0;
  Eigen::Vector2d way_m = Eigen::Vector2d::Zero();      ///< of bridge and trolley, from end to end
  Eigen::Vector2d speed_mps = Eigen::Vector2d::Zero();  ///< the largest of each
  double pixel_sigma = 0;                               ///< what the fit leaves of a pixel
  Eigen::Vector2d reading_sigma_m = Eigen::Vector2d::Zero();  ///< and of readings
  double floor_sigma_m = 0;                                   ///< unevenness of the floor
  std::array<std::size_t, 2> dropped_readings{};              ///< not believed
  std::vector<double> time_s;                                 ///< of each frame, from the first
  std::vector<Eigen::Vector2d> path_m;         ///< bridge, trolley, as the images say
  std::vector<Eigen::Vector2d> reading_off_m;  ///< what readings say minus that
  std::vector<Eigen::Vector3d> points_m;       ///< in the map: floor and what stands on it
  std::vector<bool> is_floor;                  ///< of each point
};

struct MountCalibration {
  MountVerdict verdict = MountVerdict::kBad;
  std::vector<std::string> remarks;  ///< why it is not better, and what to do
  std::array<MountValue, kMountItems> values;
  std::vector<TargetCheck> targets;
  DriveFacts drive;
  /// To be written, unless the verdict is bad: what is not determined is as it was told.
  StereoRig rig;
  MapperConfig mapper;
  std::array<double, 2> scale{1, 1};  ///< of cart, trolley: rangefinders[].scale times this

  [[nodiscard]] const MountValue& of(MountItem item) const {
    return values[static_cast<std::size_t>(item)];
  }
};

/// How the camera hangs and what readings mean, from a drive over any textured floor.
///
/// The camera does not turn while it drives: bridge and trolley move it along two directions, which
/// lie in the plane of the rails. All points that are seen again, all readings and the floor's
/// plane go into one fit (Ceres); every sigma is of its covariance and what it leaves. What a drive
/// cannot tell is not determined and has no value. Bad: the drive is of no use; remarks say why.
/// Deterministic. Some seconds.
MountCalibration calibrate_mount(const Drive& drive, const MountOptions& options);

}  // namespace crane
