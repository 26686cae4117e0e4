// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <shared_mutex>
#include <thread>

#include "base/write_file.hpp"
#include "client/area_height.hpp"
#include "client/clearance_check.hpp"
#include "client/height_grid.hpp"
#include "client/map_impl.hpp"
#include "client/map_status.hpp"
#include "map_codec/octree_stream.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

/// Beyond this ages are not what they seem. A heartbeat is up to some 0.2 s old.
constexpr double kClocksAgree_s = 1;

}  // namespace

Status Map::status() const noexcept {
  Status none;
  none.reason = kOutOfMemory;
  return answer_or(none, [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    return status_of(*impl_->follower);
  });
}

bool Map::wait_until_complete(std::chrono::milliseconds limit) const noexcept {
  return answer_or(false, [&] {
    const auto begin = Steady::now();
    do {
      {
        const std::shared_lock lock(impl_->follower->mutex);
        if (impl_->follower->complete()) return true;
      }
      std::this_thread::sleep_for(10ms);
    } while (Steady::now() - begin < limit);
    return false;
  });
}

Height Map::height(double x_m, double y_m) const noexcept {
  return answer_or(Height(), [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    if (!(impl_->follower->voxel_m() > 0) || !(std::abs(x_m) < 1e5) || !(std::abs(y_m) < 1e5))
      return Height();
    const int x = static_cast<int>(std::floor(x_m / impl_->follower->voxel_m()));
    const int y = static_cast<int>(std::floor(y_m / impl_->follower->voxel_m()));
    const HeightColumns* tile = impl_->follower->held().heights({tile_of(x), tile_of(y)});
    if (tile == nullptr) return Height();
    return to_height(tile->columns[static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x))]);
  });
}

HeightGrid Map::heights() const noexcept {
  return answer_or(HeightGrid(), [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    return height_grid(impl_->follower->held(), impl_->follower->voxel_m());
  });
}

AreaHeight Map::max_height(const Area& area) const noexcept {
  AreaHeight none;
  none.max_height_m = std::numeric_limits<double>::quiet_NaN();
  return answer_or(none, [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    return highest_in(area, impl_->follower->held(), impl_->follower->voxel_m());
  });
}

Clearance Map::clearance(const ClearanceQuery& query) const noexcept {
  Clearance none;
  none.reason = Reason::kMapInvalid;
  none.text = kOutOfMemory;
  return answer_or(none, [&] {
    Clearance out;
    const std::shared_lock lock(impl_->follower->mutex);
    const Status now = status_of(*impl_->follower);
    const bool lately = impl_->follower->lately_complete();
    if (!now.valid || !(now.complete || lately)) {
      out.reason = Reason::kMapInvalid;
      out.text = !now.valid ? now.reason : "not all tiles of the map have arrived";
      return out;
    }
    if (const double offset_s = impl_->follower->clock_offset_s();
        query.max_age_s > 0 && query.now_ns == 0 && std::abs(offset_s) > kClocksAgree_s) {
      out.reason = Reason::kMapInvalid;
      out.text = "this host's clock is " + std::to_string(offset_s) +
                 " s ahead of the mapper's: no age can be told";
      return out;
    }
    const HeldMap& held = impl_->follower->held();
    const std::vector<Zone> zones = zones_of(*impl_->follower);
    const ColumnView view{
        impl_->follower->voxel_m(), [&held](TileKey key) { return held.columns(key); },
        [&held](TileKey key) { return held.heights(key); }, &zones, now.ceiling_m};
    out = check_clearance(query, view, query.now_ns != 0 ? query.now_ns : SystemClock().now());
    out.map_id = held.map_id();
    out.revision = now.revision;
    return out;
  });
}

Map::VoxelCount Map::count_voxels() const noexcept {
  return answer_or(VoxelCount(), [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    VoxelCount count;
    for (const auto& [key, tile] : impl_->follower->held().tiles()) {
      for (const std::uint64_t bits : tile.columns.occupied)
        count.occupied += static_cast<unsigned>(__builtin_popcountll(bits));
      for (const std::uint64_t bits : tile.columns.free)
        count.free += static_cast<unsigned>(__builtin_popcountll(bits));
    }
    return count;
  });
}

Map::ColumnCount Map::count_columns() const noexcept {
  return answer_or(ColumnCount(), [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    ColumnCount count;
    for (const auto& [key, tile] : impl_->follower->held().tiles())
      for (const ColumnHeight& c : tile.heights.columns) {
        const bool known = tile.heights_sample.has_value() && is_known(c.state);
        count.known += known ? 1 : 0;
        count.lower_bounds += known && c.lower_bound ? 1 : 0;
      }
    return count;
  });
}

std::vector<Zone> Map::zones() const noexcept {
  return answer_or(std::vector<Zone>(), [&] {
    const std::shared_lock lock(impl_->follower->mutex);
    return zones_of(*impl_->follower);
  });
}

bool Map::save_bt(const std::string& path, std::string& error) const noexcept {
  return answer_or(false, [&] {
    error = kOutOfMemory;            // if nothing else comes of it
    std::vector<ClassBlock> blocks;  // copied: writing takes too long to hold up the map for
    double voxel_m = 0;
    {
      const std::shared_lock lock(impl_->follower->mutex);
      voxel_m = impl_->follower->voxel_m();
      for (const auto& [key, tile] : impl_->follower->held().tiles())
        for (const auto& [bz, classes] : tile.blocks) blocks.push_back({key, bz, classes});
    }
    if (!(voxel_m > 0)) {
      error = "no mapper heard yet";
      return false;
    }
    const Bytes bytes = write_bt(voxel_m, blocks);
    const Result<void> written = write_file(path, bytes.data(), bytes.size());
    error = written ? "" : written.error().text();
    return written.ok();
  });
}

}  // namespace crane::client
