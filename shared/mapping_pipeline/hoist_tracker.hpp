// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>

#include "config/site_config.hpp"
#include "geometry/hoist_reading.hpp"
#include "mapping/hoist.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping_pipeline/gantry.hpp"

namespace crane {

/// What is known of hook and load at an exposure.
enum class HoistKnown { kNotUsed, kKnown, kLost };

/// Follows hook and load as the controller says they are: what to cut out of a cloud, and what is
/// proven free because they were there. One thread.
class HoistTracker {
 public:
  HoistTracker(const HoistConfig& config, double camera_height_m);

  [[nodiscard]] bool used() const { return config_.enabled; }
  /// So long is a reading good for.
  [[nodiscard]] TimeNs max_gap() const { return TimeNs(config_.max_gap_ms) * 1'000'000; }
  /// Later than the last one, or nothing happens. What the controller calls failed is not added.
  /// False, and not taken, when the load is larger than configured: one of the two is wrong, and
  /// nothing may be proven free by it.
  bool add(const HoistReading& reading);
  /// Whether a reading as late as the exposure has come.
  [[nodiscard]] bool reaches(TimeNs exposure) const;
  [[nodiscard]] HoistKnown known_at(TimeNs exposure) const;
  /// How much later than the exposure the nearest reading is, when that is more than a minute off:
  /// then they are of different clocks, or of different recordings, and no gap.
  [[nodiscard]] std::optional<TimeNs> apart(TimeNs exposure) const;
  /// What may be rope, hook or load at an exposure, by the readings before and after it.
  [[nodiscard]] Bodies bodies_at(TimeNs exposure, const Eigen::Vector2d& gantry_m) const;
  /// Marks what hook and load have passed since the last call, as far as positions are known and
  /// trusted. Returns the number of voxels.
  std::size_t prove(const Gantry& gantry, OccupancyMap& map);
  /// Positions since the last prove() were wrong: what was passed then proves nothing.
  void prove_nothing();

 private:
  struct Boxes {
    HoistReading reading;
    UprightBox hook, load;
  };
  /// The last reading at or before a time.
  [[nodiscard]] std::deque<HoistReading>::const_iterator before(TimeNs time) const;

  HoistConfig config_;
  HoistGeometry geometry_;
  std::deque<HoistReading> readings_;
  std::deque<HoistReading> unproven_;
  std::optional<Boxes> last_;
};

}  // namespace crane
