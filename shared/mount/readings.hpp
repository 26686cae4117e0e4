// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "config/mapper_config.hpp"
#include "recording/recording.hpp"

namespace crane {

/// What one rangefinder said over a drive, cleaned and smooth in time.
///
/// Dropped: what is no number or out of range, single readings far off those around, and repeats
/// of a device that says each measurement several times (those would look like a delay). What jumps
/// for good is a flaw of the whole.
class Readings {
 public:
  static constexpr double kStep_s = 0.005;  ///< of the grid
  static constexpr double kReach_s = 1.0;   ///< it reaches beyond the drive by this

  /// Times are counted from `from`.
  Readings(const std::vector<RecordedDistance>& raw, TimeNs from, const MapperConfig& limits);

  /// Local mean of the distance [m], nothing known there: the nearest. Grid point i is at
  /// start_s() + i * kStep_s.
  [[nodiscard]] const std::vector<double>& grid() const { return grid_; }
  [[nodiscard]] double start_s() const { return start_s_; }
  /// Linear on the grid [m].
  [[nodiscard]] double at(double time_s) const;
  /// Readings on both sides, near enough.
  [[nodiscard]] bool known(double time_s) const;
  [[nodiscard]] double mps(double time_s) const;

  [[nodiscard]] std::size_t count() const { return time_s_.size(); }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  [[nodiscard]] double repeats() const { return repeats_; }  ///< times each measurement was said
  [[nodiscard]] double way_m() const;                        ///< from the least to the largest
  /// Why they are of no use, and what to do; empty: they are.
  [[nodiscard]] const std::string& flaw() const { return flaw_; }

 private:
  void take(const std::vector<RecordedDistance>& raw, TimeNs from, const MapperConfig& limits);
  void drop_outliers();
  void drop_repeats();
  void find_jump(const MapperConfig& limits);
  void smooth();
  [[nodiscard]] double local(double time_s, double half_s) const;

  std::vector<double> time_s_, distance_m_, grid_;
  double start_s_ = 0, repeats_ = 1, gap_s_ = 0.2;
  std::size_t dropped_ = 0;
  std::string flaw_;
};

}  // namespace crane
