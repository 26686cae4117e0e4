// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "mount/drive.hpp"
#include "mount/readings.hpp"

namespace crane {

/// Cart and trolley.
using AxisReadings = std::array<Readings, 2>;

/// What a point that was followed is.
enum class TrackKind : std::uint8_t {
  kFixed,       ///< stands in the workshop
  kFloor,       ///< and is of the floor
  kWithCamera,  ///< hangs below the trolley, or is dirt on a lens
  kMoves,       ///< goes its own way, or was followed wrongly
  kShort,       ///< seen too seldom to say
};

/// A drive's geometry. Frame of the fit: x along the runway, y square to it, z up, the camera's
/// centre in the plane z = 0 of the rails, (0, 0) where both readings are at their mean.
struct MountFit {
  std::size_t first = 0, last = 0;  ///< frames that are used: first .. last - 1
  std::array<bool, 2> driven{};     ///< which axes moved; the other has gain and latency as told
  Eigen::Matrix3d R_map_rectified = Eigen::Matrix3d::Identity();
  std::array<double, 2> gain{1, 1};   ///< metres of map by metre of reading; its sign: direction
  std::array<double, 2> latency_s{};  ///< readings are stamped later by this
  std::array<double, 2> mean_m{};     ///< reading where the place is 0
  double skew = 0;                    ///< the trolley goes along (skew, 1)
  double height_m = 1;                ///< of the camera above the floor at `centre_m`
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< of the floor
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> place_m;   ///< bridge, trolley, by the images; of each used frame
  std::vector<Eigen::Vector3d> points_m;  ///< of each track; of no meaning for kShort
  std::vector<TrackKind> kinds;
  /// Bridge's skew against its mean by a second rangefinder, of each used frame; else empty.
  std::vector<double> skew_off;
  double rail_y_m = 0;  ///< of the first rangefinder, in this frame

  // How surely. Numbers: turn of the camera in its own frame (3), gains, latencies, skew, height,
  // slopes.
  static constexpr int kNumbers = 11;
  enum Number { kTurn = 0, kGain = 3, kLatency = 5, kSkew = 7, kHeight = 8, kSlope = 9 };
  Eigen::Matrix<double, kNumbers, kNumbers> covariance =
      Eigen::Matrix<double, kNumbers, kNumbers>::Zero();
  double pixel_sigma = 0.3;
  std::array<double, 2> reading_sigma_m{0.003, 0.003};
  double floor_sigma_m = 0.02;
  std::array<double, 2> far_readings{};  ///< share of frames whose readings are far off
  /// Where in the frames a reading is known.
  std::vector<std::array<bool, 2>> known;
};

/// What a drive must have that anything can be told from it.
struct DriveNeeds {
  static double way_m(double height_m);  ///< of an axis
};

/// Where the fit begins: from frame to frame by points seen in both, regressed on the readings.
/// Nothing, and `flaw`, where the drive tells nothing. `R_map_rectified_told` and `cart_direction`
/// say which way map x grows.
std::optional<MountFit> first_guess(const Drive& drive, const AxisReadings& readings,
                                    const Eigen::Matrix3d& R_map_rectified_told,
                                    std::array<int, 2> told_direction,
                                    std::optional<int> cart_direction, std::string& flaw);

/// Which points are the floor: the level that many points have, near the told height where there
/// are several. Sets kinds, height and levels found.
void find_floor(const Drive& drive, MountFit& fit, std::vector<double>& levels_m);

/// One joint fit of all sightings, readings and the floor; with covariance. False: it does not
/// converge.
bool refine(const Drive& drive, const AxisReadings& readings, MountFit& fit);

}  // namespace crane
