// SPDX-License-Identifier: Apache-2.0
#include "client/area_height.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane::client {

AreaHeight highest_in(const Area& area, const HeldMap& held, double voxel_m) {
  AreaHeight out;
  out.max_height_m = std::numeric_limits<double>::quiet_NaN();
  const auto sane = [](double v) { return std::abs(v) < 1e5; };
  if (!(voxel_m > 0) || !sane(area.x0_m) || !sane(area.x1_m) || !sane(area.y0_m) ||
      !sane(area.y1_m))
    return out;
  const auto index = [voxel_m](double v) { return static_cast<int>(std::floor(v / voxel_m)); };
  const int x0 = index(area.x0_m), x1 = index(area.x1_m);
  const int y0 = index(area.y0_m), y1 = index(area.y1_m);
  constexpr double kMaxColumns = 4e6;  // as a clearance query: nothing is to wait for more
  if (x1 < x0 || y1 < y0 || (double(x1) - x0 + 1) * (double(y1) - y0 + 1) > kMaxColumns) return out;
  std::uint64_t columns = 0, unknown = 0, bounds = 0;
  std::uint32_t fewest = std::numeric_limits<std::uint32_t>::max();
  for (int y = y0; y <= y1; ++y) {
    const HeightColumns* tile = nullptr;
    for (int x = x0; x <= x1; ++x) {
      if (x == x0 || in_tile(x) == 0) tile = held.heights({tile_of(x), tile_of(y)});
      ++columns;
      const ColumnHeight* c = tile != nullptr
                                  ? &tile->columns[std::size_t(in_tile(y) * kTileEdge + in_tile(x))]
                                  : nullptr;
      if (c == nullptr || !is_known(c->state)) {
        ++unknown;
        continue;
      }
      if (!(out.max_height_m >= c->height_m)) out.max_height_m = c->height_m;
      bounds += c->lower_bound ? 1 : 0;
      fewest = std::min<std::uint32_t>(fewest, c->views);
      if (out.oldest_observed_ns == 0 || c->last_observed < out.oldest_observed_ns)
        out.oldest_observed_ns = c->last_observed;
    }
  }
  out.unknown_fraction = double(unknown) / double(columns);
  out.lower_bound_fraction = double(bounds) / double(columns);
  out.fewest_views = unknown < columns ? fewest : 0;
  return out;
}

}  // namespace crane::client
