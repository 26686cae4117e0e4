// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/occupancy_map.hpp"

namespace crane {

/// What is not measured again becomes unknown, never free. Looks at a few tiles at a time, in turn,
/// so that each is looked at several times before it could be missed.
class Forgetting {
 public:
  /// `after_s`: age at which a voxel is forgotten [s]; 0 = never.
  explicit Forgetting(double after_s) : after_s_(after_s) {}

  /// Sets the map's epoch to that of `time` and forgets what is too old. To be called with every
  /// frame, and at least every second without. Cost O(tiles * time since the last call / after_s).
  void advance(TimeNs time, OccupancyMap& map);
  /// The epoch of a time of the map.
  [[nodiscard]] Epoch epoch_at(TimeNs time) const {
    if (!(after_s_ > 0)) return 1;
    const double epochs = double(time) * 1e-9 / after_s_ * double(kEpochsToForget);
    return epoch_of(static_cast<std::uint64_t>(std::max(0.0, epochs)));
  }
  [[nodiscard]] std::uint64_t forgotten_voxels() const { return forgotten_; }

 private:
  double after_s_;
  TimeNs last_ = 0;
  double due_ = 0;  ///< tiles to look at, with the fraction left over
  std::vector<TileKey> round_;
  std::uint64_t forgotten_ = 0;
};

/// Forgets voxels of a tile that are older than kEpochsToForget at the map's epoch. Returns how
/// many.
std::uint64_t forget_old(Tile& tile, OccupancyMap& map);

}  // namespace crane
