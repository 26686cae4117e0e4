// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "crane/client/map.hpp"
#include "geometry/stereo_rig.hpp"
#include "height_picture.hpp"

namespace crane {

/// A map as it is held at one moment, and what is known of the crane then.
struct MapSnapshot {
  TimeNs taken = 0;
  int crane = 0;
  client::Status status;
  client::HeightGrid grid;
  std::vector<client::Zone> zones;
  std::optional<LiveOverlay::Point> position;  ///< cart and trolley, map
  std::optional<StereoRig> rig;                ///< for what the camera sees
};

/// Ages of the surfaces that are known [s].
struct SurfaceAges {
  std::size_t known = 0, stale = 0;  ///< columns
  double newest_s = 0, median_s = 0, oldest_s = 0;
};
SurfaceAges ages_of(const client::HeightGrid& grid, TimeNs now);

/// Of `map.bt` in `folder`: map.ot, map.pcd, map.ply; of the snapshot: height_map.png,
/// map_view.png, map_ages.png, snapshot.yaml. Error: Resource; NotAvailable for an empty map.
Result<void> write_snapshot(const MapSnapshot& snapshot, const std::string& folder);

}  // namespace crane
