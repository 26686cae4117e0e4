#include "crane/client/map.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <shared_mutex>
#include <thread>

#include "base/loop_watch.hpp"
#include "base/write_file.hpp"
#include "client/area_height.hpp"
#include "client/clearance_check.hpp"
#include "client/height_grid.hpp"
#include "client/map_status.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_sync/map_follower.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

/// Beyond this ages are not what they seem. A heartbeat is up to some 0.2 s old.
constexpr double kClocksAgree_s = 1;
/// All tiles of a large hall may arrive at once.
constexpr auto kTurnsWithin = 10s;

dds::Transport transport_of(const Options& o) {
  return o.network == Options::Network::kLocal && o.shared_memory ? dds::Transport::kAuto
                                                                  : dds::Transport::kUdp;
}

/// What is asked for, or `none` when there is no memory for it.
template <class Answer, class Ask>
Answer answer_or(const Answer& none, const Ask& ask) noexcept {
  try {
    return ask();
  } catch (...) {
    return none;
  }
}

constexpr const char* kOutOfMemory = "out of memory";  // so short that a string of it takes none

}  // namespace

struct Map::Impl {
  Wakeup wakeup;  ///< outlives those that tell it
  std::unique_ptr<MapFollower> follower;

  std::mutex callback_mutex;
  /// Shared with the call that is going on, which may replace it.
  std::shared_ptr<const std::function<void(const Update&)>> callback;
  std::atomic<std::thread::id> calling{};

  std::atomic<bool> stop{false};
  const LoopWatch::Mark turning = LoopWatch::of_process().watch("map follower", kTurnsWithin);
  std::thread thread;

  ~Impl() {
    stop = true;
    wakeup.notify();
    if (thread.joinable()) thread.join();
  }

  void run() {
    name_thread("map follower");
    while (!stop) {
      turning.turned();
      try {
        wakeup.wait_for(100ms);
        tell(follower->step());
      } catch (...) {
        // Out of memory, or thrown by the callback: the map itself is whole.
        calling = std::thread::id();
      }
    }
  }

  void tell(const std::vector<TileKey>& changed) {
    if (changed.empty()) return;
    Update update;
    {
      const std::shared_lock lock(follower->mutex);
      const Status s = status_of(*follower);
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

std::unique_ptr<Map> Map::join(const Options& options, std::string& error) noexcept {
  try {
    return join_or_throw(options, error);
  } catch (const std::exception& e) {
    error = answer_or(std::string(kOutOfMemory), [&] { return std::string(e.what()); });
  } catch (...) {
    error = "unknown";
  }
  return nullptr;
}

std::unique_ptr<Map> Map::join_or_throw(const Options& options, std::string& error) {
  dds::Settings settings;
  settings.guest = true;
  settings.crane = options.crane;
  settings.domain = options.domain;
  settings.transport = transport_of(options);
  settings.multicast = options.network != Options::Network::kPlant;
  settings.interfaces = options.interfaces;
  settings.servers = options.servers;
  settings.peers = options.peers;
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
  auto follower =
      MapFollower::create(*participant, &impl->wakeup, std::size_t(options.max_memory_mib) << 20U);
  if (!follower) {
    error = follower.error().text();
    return nullptr;
  }
  impl->follower = std::move(*follower);
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Map>(new Map(std::move(impl)));
}

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

bool Map::on_update(std::function<void(const Update&)> callback) noexcept {
  return answer_or(false, [&] {
    std::shared_ptr<const std::function<void(const Update&)>> next;
    if (callback)
      next = std::make_shared<const std::function<void(const Update&)>>(std::move(callback));
    if (impl_->calling == std::this_thread::get_id()) {  // which holds the mutex
      impl_->callback = std::move(next);
      return true;
    }
    const std::lock_guard lock(impl_->callback_mutex);
    impl_->callback = std::move(next);
    return true;
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
