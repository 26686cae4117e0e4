// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "base/drop_counts.hpp"
#include "config/site_config.hpp"
#include "geometry/position_track.hpp"

namespace crane {

enum class Axis { kCart, kTrolley, kCartSecond };

/// Where cart and trolley are, by their rangefinders: each reading moved by the latency of its
/// device, checked, and turned into a map coordinate by direction and offset. A second one of the
/// cart, at the other rail, tells how skew the bridge is. One thread.
class Gantry {
 public:
  explicit Gantry(const MapperConfig& config);

  /// `stream`: of the axis's readings; a new one begins with no positions known of that axis.
  /// Returns why the reading is not used, if so.
  std::optional<Cause> add(Axis axis, std::uint64_t stream, TimeNs time, double distance_m);

  struct Place {
    PositionTrack::Lookup known = PositionTrack::Lookup::kNotYet;  ///< the worse of both axes
    Eigen::Vector2d map_m = Eigen::Vector2d::Zero();  ///< cart, trolley: kFound, kUnconfirmed
    /// How skew the bridge is, about map z: where two rangefinders of the cart tell; else 0.
    double skew_rad = 0;
  };
  [[nodiscard]] Place at(TimeNs time) const;
  /// A frame of that time is in the map: its positions were right.
  void trust(TimeNs time);

  /// Whether the newest readings of an axis are believed, and by how much they jumped if not [m].
  [[nodiscard]] bool trusted(Axis axis) const { return of(axis).track.trusted(); }
  [[nodiscard]] double jump_m(Axis axis) const { return of(axis).track.last_jump_m(); }

 private:
  struct Device {
    PositionTrack track;
    TimeNs latency;
    double direction, offset_m;
    std::optional<std::uint64_t> stream;
  };
  [[nodiscard]] Device& of(Axis axis) { return devices_[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] const Device& of(Axis axis) const {
    return devices_[static_cast<std::size_t>(axis)];
  }

  [[nodiscard]] std::size_t used() const { return rail_span_m_ != 0 ? 3 : 2; }

  std::array<Device, 3> devices_;  ///< as Axis counts
  double rail_y_m_, rail_span_m_;
  double largest_skew_rad_;
};

}  // namespace crane
