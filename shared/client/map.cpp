#include "crane/client/map.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <shared_mutex>
#include <thread>

#include "base/write_file.hpp"
#include "bounds.h"
#include "client/clearance_check.hpp"
#include "client/map_follower.hpp"
#include "map_codec/octree_stream.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

/// Beyond this ages are not what they seem. A heartbeat is up to some 0.2 s old.
constexpr double kClocksAgree_s = 1;

static_assert(int(Surface::kStale) == int(ColumnState::kStale) &&
              int(Surface::kObstacle) == int(ColumnState::kObstacle));

Height to_height(const ColumnHeight& c) {
  Height h;
  h.surface = static_cast<Surface>(c.state);
  h.height_m = c.height_m;
  h.spread_m = c.spread_m;
  h.lower_bound = c.lower_bound;
  h.free_to_m = c.free_to_m;
  h.views = c.views;
  h.last_observed_ns = c.last_observed;
  h.proven_by_hook = std::isfinite(c.proven_m);
  if (h.proven_by_hook) h.proven_m = c.proven_m;
  return h;
}

dds::Transport transport_of(const Options& o) {
  if (o.network == Options::Network::kWan) return dds::Transport::kWan;
  return o.network == Options::Network::kLocal && o.shared_memory ? dds::Transport::kAuto
                                                                  : dds::Transport::kUdp;
}

}  // namespace

struct Map::Impl {
  Wakeup wakeup;  ///< outlives those that tell it
  std::unique_ptr<MapFollower> follower;

  std::mutex callback_mutex;
  /// Shared with the call that is going on, which may replace it.
  std::shared_ptr<const std::function<void(const Update&)>> callback;
  std::atomic<std::thread::id> calling{};

  std::atomic<bool> stop{false};
  std::thread thread;

  ~Impl() {
    stop = true;
    wakeup.notify();
    if (thread.joinable()) thread.join();
  }

  void run() {
    while (!stop) {
      wakeup.wait_for(100ms);
      tell(follower->step());
    }
  }

  void tell(const std::vector<TileKey>& changed) {
    if (changed.empty()) return;
    Update update;
    {
      const std::shared_lock lock(follower->mutex);
      const Status s = follower->status();
      update = {s.map_id, s.revision, s.valid, s.complete, {}};
      const double edge = follower->voxel_m() * kTileEdge;
      for (const TileKey key : changed)
        update.areas.push_back(
            {key.x * edge, key.y * edge, (key.x + 1) * edge, (key.y + 1) * edge});
    }
    const std::lock_guard lock(callback_mutex);
    calling = std::this_thread::get_id();
    if (const auto running = callback; running != nullptr) (*running)(update);
    calling = std::thread::id();
  }
};

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Map::~Map() = default;

std::unique_ptr<Map> Map::join(const Options& options, std::string& error) {
  dds::Settings settings;
  settings.crane = options.crane;
  settings.domain = options.domain;
  settings.transport = transport_of(options);
  settings.multicast = options.network != Options::Network::kPlant;
  settings.interfaces = options.interfaces;
  settings.servers = options.servers;
  settings.peers = options.peers;
  settings.tcp_port = options.tcp_port;
  settings.security = options.security;
  settings.identity = options.identity;
  settings.profile_file = options.profile_file;
  settings.profile_name = options.profile_name;
  auto impl = std::make_unique<Impl>();
  auto participant = dds::Participant::create(settings, "cranemap-client");
  if (!participant) {
    error = participant.error().text();
    return nullptr;
  }
  auto follower = MapFollower::create(*participant, &impl->wakeup);
  if (!follower) {
    error = follower.error().text();
    return nullptr;
  }
  impl->follower = std::move(*follower);
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Map>(new Map(std::move(impl)));
}

Status Map::status() const {
  const std::shared_lock lock(impl_->follower->mutex);
  return impl_->follower->status();
}

bool Map::wait_until_complete(std::chrono::milliseconds limit) const {
  for (const auto end = Steady::now() + limit; Steady::now() < end;) {
    {
      const std::shared_lock lock(impl_->follower->mutex);
      if (impl_->follower->complete()) return true;
    }
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

Height Map::height(double x_m, double y_m) const {
  const std::shared_lock lock(impl_->follower->mutex);
  if (!(impl_->follower->voxel_m() > 0) || !(std::abs(x_m) < 1e5) || !(std::abs(y_m) < 1e5))
    return {};
  const int x = static_cast<int>(std::floor(x_m / impl_->follower->voxel_m()));
  const int y = static_cast<int>(std::floor(y_m / impl_->follower->voxel_m()));
  const HeightColumns* tile = impl_->follower->held().heights({tile_of(x), tile_of(y)});
  if (tile == nullptr) return {};
  return to_height(tile->columns[static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x))]);
}

HeightGrid Map::heights() const {
  const std::shared_lock lock(impl_->follower->mutex);
  HeightGrid grid;
  std::optional<TileKey> low, high;
  for (const auto& [key, tile] : impl_->follower->held().tiles()) {
    if (!tile.heights_sample) continue;
    low = low ? TileKey{std::min(low->x, key.x), std::min(low->y, key.y)} : key;
    high = high ? TileKey{std::max(high->x, key.x), std::max(high->y, key.y)} : key;
  }
  if (!low) return grid;
  grid.cell_m = impl_->follower->voxel_m();
  grid.origin_x_m = low->x * kTileEdge * grid.cell_m;
  grid.origin_y_m = low->y * kTileEdge * grid.cell_m;
  grid.columns = static_cast<std::uint32_t>((high->x - low->x + 1) * kTileEdge);
  grid.rows = static_cast<std::uint32_t>((high->y - low->y + 1) * kTileEdge);
  grid.cells.resize(std::size_t(grid.columns) * grid.rows);
  for (const auto& [key, tile] : impl_->follower->held().tiles()) {
    if (!tile.heights_sample) continue;
    for (std::size_t i = 0; i < kTileColumns; ++i) {
      const std::size_t column = std::size_t(key.x - low->x) * kTileEdge + i % kTileEdge;
      const std::size_t row = std::size_t(key.y - low->y) * kTileEdge + i / kTileEdge;
      grid.cells[row * grid.columns + column] = to_height(tile.heights.columns[i]);
    }
  }
  return grid;
}

AreaHeight Map::max_height(const Area& area) const {
  const std::shared_lock lock(impl_->follower->mutex);
  AreaHeight out;
  out.max_height_m = std::numeric_limits<double>::quiet_NaN();
  const double cell = impl_->follower->voxel_m();
  const auto sane = [](double v) { return std::abs(v) < 1e5; };
  if (!(cell > 0) || !sane(area.x0_m) || !sane(area.x1_m) || !sane(area.y0_m) || !sane(area.y1_m))
    return out;
  constexpr double kMaxColumns = 4e6;  // as a clearance query: nothing is to wait for more
  if ((area.x1_m - area.x0_m) / cell * ((area.y1_m - area.y0_m) / cell) > kMaxColumns) return out;
  const auto index = [cell](double v) { return static_cast<int>(std::floor(v / cell)); };
  std::uint64_t columns = 0;
  std::uint64_t unknown = 0;
  std::uint64_t bounds = 0;
  std::uint32_t fewest = std::numeric_limits<std::uint32_t>::max();
  for (int y = index(area.y0_m); y <= index(area.y1_m); ++y) {
    const HeightColumns* tile = nullptr;
    for (int x = index(area.x0_m); x <= index(area.x1_m); ++x) {
      if (x == index(area.x0_m) || in_tile(x) == 0)
        tile = impl_->follower->held().heights({tile_of(x), tile_of(y)});
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
  if (columns > 0) out.unknown_fraction = double(unknown) / double(columns);
  if (columns > 0) out.lower_bound_fraction = double(bounds) / double(columns);
  out.fewest_views = unknown < columns ? fewest : 0;
  return out;
}

Clearance Map::clearance(const ClearanceQuery& query) const {
  Clearance out;
  const std::shared_lock lock(impl_->follower->mutex);
  const Status now = impl_->follower->status();
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
  const ColumnView view{
      impl_->follower->voxel_m(), [&held](TileKey key) { return held.columns(key); },
      [&held](TileKey key) { return held.heights(key); }, &held.zones(), now.ceiling_m};
  out = check_clearance(query, view, query.now_ns != 0 ? query.now_ns : SystemClock().now());
  out.map_id = held.map_id();
  out.revision = now.revision;
  return out;
}

Map::VoxelCount Map::count_voxels() const {
  const std::shared_lock lock(impl_->follower->mutex);
  VoxelCount count;
  for (const auto& [key, tile] : impl_->follower->held().tiles()) {
    for (const std::uint64_t bits : tile.columns.occupied)
      count.occupied += static_cast<unsigned>(__builtin_popcountll(bits));
    for (const std::uint64_t bits : tile.columns.free)
      count.free += static_cast<unsigned>(__builtin_popcountll(bits));
  }
  return count;
}

std::vector<Zone> Map::zones() const {
  const std::shared_lock lock(impl_->follower->mutex);
  return impl_->follower->held().zones();
}

void Map::on_update(std::function<void(const Update&)> callback) {
  std::shared_ptr<const std::function<void(const Update&)>> next;
  if (callback)
    next = std::make_shared<const std::function<void(const Update&)>>(std::move(callback));
  if (impl_->calling == std::this_thread::get_id()) {  // which holds the mutex
    impl_->callback = std::move(next);
    return;
  }
  const std::lock_guard lock(impl_->callback_mutex);
  impl_->callback = std::move(next);
}

bool Map::save_bt(const std::string& path, std::string& error) const {
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
  if (!written) error = written.error().text();
  return written.ok();
}

}  // namespace crane::client
