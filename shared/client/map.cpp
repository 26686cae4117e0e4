#include "crane/client/map.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <random>
#include <shared_mutex>
#include <thread>

#include "base/write_file.hpp"
#include "bounds.h"
#include "client/clearance_check.hpp"
#include "client/held_map.hpp"
#include "dds/endpoints.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/octree_stream.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

/// So long may what is held lag behind what the mapper says of the map.
constexpr auto kMayLag = 500ms;
/// Nothing has come for so long, and still it is not complete: something was lost.
constexpr auto kResyncAfter = 700ms;
constexpr int kResyncsUntilAnew = 3;

static_assert(int(Status::Hoist::kNotUsed) == v1::HOIST_NOT_USED &&
              int(Status::Hoist::kKnown) == v1::HOIST_KNOWN &&
              int(Status::Hoist::kLost) == v1::HOIST_LOST);
static_assert(int(Zone::Kind::kNoGo) == v1::ZONE_NO_GO &&
              int(Zone::Kind::kSlowDown) == v1::ZONE_SLOW_DOWN);
static_assert(int(Surface::kStale) == int(ColumnState::kStale) &&
              int(Surface::kObstacle) == int(ColumnState::kObstacle));

std::vector<Zone> to_zones(const v1::ZoneSet& set) {
  std::vector<Zone> out;
  for (const v1::Zone& z : set.zones()) {
    Zone zone;
    zone.id = z.id();
    zone.kind = static_cast<Zone::Kind>(z.kind());
    zone.active = z.active() == 1;
    zone.switchable = z.switchable() == 1;
    zone.z_min_m = z.z_min_m();
    zone.z_max_m = z.z_max_m();
    zone.name = z.name().c_str();
    for (const v1::ZoneCorner& c : z.corners()) zone.corners.push_back({c.x_m(), c.y_m()});
    out.push_back(std::move(zone));
  }
  return out;
}

Height to_height(const ColumnHeight& c) {
  Height h{static_cast<Surface>(c.state), c.height_m, c.spread_m, c.last_observed, false, 0};
  h.proven_by_hook = std::isfinite(c.proven_m);
  if (h.proven_by_hook) h.proven_m = c.proven_m;
  return h;
}

/// Key fields of the tile topics, as DDS writes them: crane, tile_x, tile_y, tile_z.
BandKey band_key(const dds::InstanceKey& k) {
  const auto at = [&k](std::size_t i) {
    return static_cast<std::int16_t>(static_cast<unsigned>(k[i]) << 8U | k[i + 1]);
  };
  return {at(4), at(6), at(8)};
}

dds::Transport transport_of(Options::Network network) {
  switch (network) {
    case Options::Network::kLocal:
      return dds::Transport::kAuto;
    case Options::Network::kWan:
      return dds::Transport::kWan;
    default:
      return dds::Transport::kUdp;
  }
}

std::uint64_t random_id() {
  std::random_device device;
  return std::uint64_t(device()) << 32U | device();
}

}  // namespace

struct Map::Impl {
  std::shared_ptr<dds::Participant> participant;
  Wakeup wakeup;
  std::optional<dds::Reader<dds::MapTileTopic>> voxel_reader;
  std::optional<dds::Reader<dds::HeightTileTopic>> height_reader;
  std::optional<dds::Reader<dds::MapStatusTopic>> status_reader;
  std::optional<dds::Reader<dds::ZoneSetTopic>> zone_reader;
  std::optional<dds::Writer<dds::TileRequestTopic>> request_writer;

  /// Readers share it. The one writer, run(), prepares what it puts without it.
  mutable std::shared_mutex mutex;
  HeldMap held;  ///< of the map that the mapper says it serves
  HeldMap next;  ///< of another one, whose tiles came before the mapper said so
  double voxel_m = 0;
  std::uint64_t refused = 0, resyncs = 0;
  std::optional<v1::MapStatus> said;
  Steady::time_point said_at{}, complete_at{};

  // Of run() only.
  Steady::time_point tile_at{}, asked_at{};
  int asked_in_vain = 0;
  std::uint64_t client = random_id(), request_number = 0;
  std::vector<TileKey> changed;

  std::mutex callback_mutex;
  std::function<void(const Update&)> callback;
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
      while (const auto tile = voxel_reader->take()) take_voxels(*tile);
      while (const auto tile = height_reader->take()) take_heights(*tile);
      while (const auto set = zone_reader->take()) take_zones(**set);
      while (const auto status = status_reader->take()) take_status(**status);
      bool whole = false;
      {
        const std::unique_lock lock(mutex);
        whole = complete();
        if (whole) complete_at = Steady::now();
      }
      if (whole)
        asked_in_vain = 0;
      else
        resync();
      tell();
    }
  }

  /// The map that a sample belongs to; that of the mapper's word, or the one after it.
  HeldMap& map_of(std::uint64_t map_id) {
    if (map_id == held.map_id()) return held;
    if (map_id != next.map_id()) next = HeldMap(map_id);
    return next;
  }
  void refuse() {
    const std::unique_lock lock(mutex);
    ++refused;
  }
  template <class Sample>
  [[nodiscard]] bool ours(const Sample& s) const {
    return s.crane() == participant->settings().crane;
  }

  void take_voxels(const dds::Received<v1::MapTile>& received) {
    if (received.disposed()) {
      const BandKey key = band_key(received.key());
      const std::unique_lock lock(mutex);
      held.remove_voxels(key);
      next.remove_voxels(key);
      changed.push_back(key.tile());
      return;
    }
    const v1::MapTile& s = *received;
    if (!ours(s) || crc32c(s.payload()) != s.crc32c()) return refuse();
    auto decoded = decode_tile(s.payload(), s.tile_z());
    if (!decoded) return refuse();
    const BandKey key{s.tile_x(), s.tile_y(), s.tile_z()};
    auto voxels = map_of(s.map_id()).prepare(key, s.revision(), s.crc32c(), *decoded);
    const std::unique_lock lock(mutex);
    refused += map_of(s.map_id()).put(std::move(voxels)) ? 0 : 1;
    arrived(key.tile());
  }

  void take_heights(const dds::Received<v1::HeightTile>& received) {
    if (received.disposed()) {
      const TileKey key = band_key(received.key()).tile();
      const std::unique_lock lock(mutex);
      held.remove_heights(key);
      next.remove_heights(key);
      changed.push_back(key);
      return;
    }
    const v1::HeightTile& s = *received;
    if (!ours(s) || crc32c(s.payload()) != s.crc32c()) return refuse();
    const auto decoded = decode_heights(s.payload());
    if (!decoded) return refuse();
    const TileKey key{s.tile_x(), s.tile_y()};
    HeightColumns heights{*decoded, {}};
    heights.sum_up();
    const std::unique_lock lock(mutex);
    refused += map_of(s.map_id()).put(key, s.revision(), s.crc32c(), heights) ? 0 : 1;
    arrived(key);
  }

  void arrived(TileKey key) {
    tile_at = Steady::now();
    changed.push_back(key);
  }

  void take_zones(const v1::ZoneSet& s) {
    if (!ours(s)) return refuse();
    const std::unique_lock lock(mutex);
    map_of(s.map_id()).put(s.revision(), to_zones(s));
  }

  void take_status(const v1::MapStatus& s) {
    if (!ours(s)) return refuse();
    const std::unique_lock lock(mutex);
    if (s.map_id() != held.map_id()) {  // what is held belongs to the old one
      HeldMap fresh(s.map_id());
      if (next.map_id() == s.map_id()) std::swap(fresh, next);
      held = std::move(fresh);
      next = HeldMap();
      complete_at = {};
      tile_at = Steady::now();  // its tiles are on their way
    }
    voxel_m = s.voxel_m();
    said = s;
    said_at = Steady::now();
  }

  /// Asks for what is missing when nothing more seems to come.
  void resync() {
    const auto now = Steady::now();
    if (!said || now - said_at > 1s || now - tile_at < kResyncAfter ||
        now - complete_at < kResyncAfter || now - asked_at < kResyncAfter)
      return;
    asked_at = now;
    v1::TileRequest request;
    {
      const std::unique_lock lock(mutex);
      // More than the map has, or what it no longer has, cannot be asked for: begin anew.
      if (++asked_in_vain > kResyncsUntilAnew) {
        held = HeldMap(said->map_id());
        asked_in_vain = 0;
      }
      ++resyncs;
      request.map_id(held.map_id());
      request.voxel_digests() = held.voxel_digests().buckets;
      request.height_digests() = held.height_digests().buckets;
    }
    request.crane(participant->settings().crane);
    request.client(client);
    request.sequence_number(request_number++);
    request.time_ns(SystemClock().now());
    (void)request_writer->write(request);  // else again the next time
  }

  void tell() {
    if (changed.empty()) return;
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    Update update;
    {
      const std::shared_lock lock(mutex);
      const Status s = status();
      update = {s.map_id, s.revision, s.valid, s.complete, {}};
      const double edge = voxel_m * kTileEdge;
      for (const TileKey key : changed)
        update.areas.push_back(
            {key.x * edge, key.y * edge, (key.x + 1) * edge, (key.y + 1) * edge});
    }
    changed.clear();
    const std::lock_guard lock(callback_mutex);
    calling = std::this_thread::get_id();
    if (callback) callback(update);
    calling = std::thread::id();
  }

  // ------------------------------------------------ The caller holds the mutex.

  [[nodiscard]] Status status() const {
    Status out;
    out.voxel_digest = held.voxel_digests().all;
    out.height_digest = held.height_digests().all;
    out.tiles = held.voxel_tiles();
    out.zones_revision = held.zones_revision();
    out.samples_refused = refused;
    out.resyncs = resyncs;
    if (!said) {
      out.reason = "no mapper heard yet";
      return out;
    }
    const v1::MapStatus& s = *said;
    out.heard = true;
    out.alive = Steady::now() - said_at < 1s;
    out.valid = out.alive && s.validity() == 0;
    out.complete = complete();
    out.reason = out.alive ? s.reason().c_str() : "no heartbeat of the mapper for more than 1 s";
    out.mapper = s.mapper();
    out.map_id = s.map_id();
    out.revision = s.revision();
    out.voxel_m = s.voxel_m();
    out.stream = s.stream();
    out.last_frame = s.last_frame();
    out.last_frame_time_ns = s.last_frame_time_ns();
    out.frames_integrated = s.frames_integrated();
    out.frames_rejected = s.frames_rejected();
    out.frames_missing = s.frames_missing();
    out.hoist = static_cast<Status::Hoist>(s.hoist());
    out.forget_s = s.forget_s();
    return out;
  }

  [[nodiscard]] bool complete() const {
    return said && said->map_id() == held.map_id() && said->voxel_tiles() == held.voxel_tiles() &&
           said->height_tiles() == held.height_tiles() &&
           said->voxel_digest() == held.voxel_digests().all &&
           said->height_digest() == held.height_digests().all &&
           said->zones_revision() == held.zones_revision();
  }
};

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Map::~Map() = default;

std::unique_ptr<Map> Map::join(const Options& options, std::string& error) {
  dds::Settings settings;
  settings.crane = options.crane;
  settings.domain = options.domain;
  settings.transport = transport_of(options.network);
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
  impl->participant = *participant;
  const auto make = [&](auto made, auto& into) {
    if (made)
      into.emplace(std::move(*made));
    else
      error = made.error().text();
    return made.ok();
  };
  const auto& p = impl->participant;
  Wakeup* wakeup = &impl->wakeup;
  if (!make(dds::Reader<dds::MapTileTopic>::create(p, wakeup), impl->voxel_reader) ||
      !make(dds::Reader<dds::HeightTileTopic>::create(p, wakeup), impl->height_reader) ||
      !make(dds::Reader<dds::ZoneSetTopic>::create(p, wakeup), impl->zone_reader) ||
      !make(dds::Reader<dds::MapStatusTopic>::create(p, wakeup), impl->status_reader) ||
      !make(dds::Writer<dds::TileRequestTopic>::create(p), impl->request_writer))
    return nullptr;
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Map>(new Map(std::move(impl)));
}

Status Map::status() const {
  const std::shared_lock lock(impl_->mutex);
  return impl_->status();
}

bool Map::wait_until_complete(std::chrono::milliseconds limit) const {
  for (const auto end = Steady::now() + limit; Steady::now() < end;) {
    {
      const std::shared_lock lock(impl_->mutex);
      if (impl_->complete()) return true;
    }
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

Height Map::height(double x_m, double y_m) const {
  const std::shared_lock lock(impl_->mutex);
  if (!(impl_->voxel_m > 0) || !(std::abs(x_m) < 1e5) || !(std::abs(y_m) < 1e5)) return {};
  const int x = static_cast<int>(std::floor(x_m / impl_->voxel_m));
  const int y = static_cast<int>(std::floor(y_m / impl_->voxel_m));
  const HeightColumns* tile = impl_->held.heights({tile_of(x), tile_of(y)});
  if (tile == nullptr) return {};
  return to_height(tile->columns[static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x))]);
}

HeightGrid Map::heights() const {
  const std::shared_lock lock(impl_->mutex);
  HeightGrid grid;
  std::optional<TileKey> low, high;
  for (const auto& [key, tile] : impl_->held.tiles()) {
    if (!tile.heights_sample) continue;
    low = low ? TileKey{std::min(low->x, key.x), std::min(low->y, key.y)} : key;
    high = high ? TileKey{std::max(high->x, key.x), std::max(high->y, key.y)} : key;
  }
  if (!low) return grid;
  grid.cell_m = impl_->voxel_m;
  grid.origin_x_m = low->x * kTileEdge * grid.cell_m;
  grid.origin_y_m = low->y * kTileEdge * grid.cell_m;
  grid.columns = static_cast<std::uint32_t>((high->x - low->x + 1) * kTileEdge);
  grid.rows = static_cast<std::uint32_t>((high->y - low->y + 1) * kTileEdge);
  grid.cells.resize(std::size_t(grid.columns) * grid.rows);
  for (const auto& [key, tile] : impl_->held.tiles()) {
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
  const std::shared_lock lock(impl_->mutex);
  AreaHeight out;
  out.max_height_m = std::numeric_limits<double>::quiet_NaN();
  const double cell = impl_->voxel_m;
  const auto sane = [](double v) { return std::abs(v) < 1e5; };
  if (!(cell > 0) || !sane(area.x0_m) || !sane(area.x1_m) || !sane(area.y0_m) || !sane(area.y1_m))
    return out;
  const auto index = [cell](double v) { return static_cast<int>(std::floor(v / cell)); };
  std::uint64_t columns = 0;
  std::uint64_t unknown = 0;
  for (int y = index(area.y0_m); y <= index(area.y1_m); ++y) {
    const HeightColumns* tile = nullptr;
    for (int x = index(area.x0_m); x <= index(area.x1_m); ++x) {
      if (x == index(area.x0_m) || in_tile(x) == 0)
        tile = impl_->held.heights({tile_of(x), tile_of(y)});
      ++columns;
      const ColumnHeight* c = tile != nullptr
                                  ? &tile->columns[std::size_t(in_tile(y) * kTileEdge + in_tile(x))]
                                  : nullptr;
      if (c == nullptr || !is_known(c->state)) {
        ++unknown;
        continue;
      }
      if (!(out.max_height_m >= c->height_m)) out.max_height_m = c->height_m;
      if (out.oldest_observed_ns == 0 || c->last_observed < out.oldest_observed_ns)
        out.oldest_observed_ns = c->last_observed;
    }
  }
  if (columns > 0) out.unknown_fraction = double(unknown) / double(columns);
  return out;
}

Clearance Map::clearance(const ClearanceQuery& query) const {
  Clearance out;
  const std::shared_lock lock(impl_->mutex);
  const Status now = impl_->status();
  // While the tiles of a new revision arrive, what is held is that of the last one.
  const bool lately = Steady::now() - impl_->complete_at < kMayLag;
  if (!now.valid || !(now.complete || lately)) {
    out.reason = Reason::kMapInvalid;
    out.text = !now.valid ? now.reason : "not all tiles of the map have arrived";
    return out;
  }
  const HeldMap& held = impl_->held;
  const ColumnView view{impl_->voxel_m, [&held](TileKey key) { return held.columns(key); },
                        [&held](TileKey key) { return held.heights(key); }, &held.zones()};
  out = check_clearance(query, view, query.now_ns != 0 ? query.now_ns : SystemClock().now());
  out.map_id = held.map_id();
  out.revision = now.revision;
  return out;
}

Map::VoxelCount Map::count_voxels() const {
  const std::shared_lock lock(impl_->mutex);
  VoxelCount count;
  for (const auto& [key, tile] : impl_->held.tiles()) {
    for (const std::uint64_t bits : tile.columns.occupied)
      count.occupied += static_cast<unsigned>(__builtin_popcountll(bits));
    for (const std::uint64_t bits : tile.columns.free)
      count.free += static_cast<unsigned>(__builtin_popcountll(bits));
  }
  return count;
}

std::vector<Zone> Map::zones() const {
  const std::shared_lock lock(impl_->mutex);
  return impl_->held.zones();
}

void Map::on_update(std::function<void(const Update&)> callback) {
  if (impl_->calling == std::this_thread::get_id()) {
    impl_->callback = std::move(callback);
    return;
  }
  const std::lock_guard lock(impl_->callback_mutex);
  impl_->callback = std::move(callback);
}

bool Map::save_bt(const std::string& path, std::string& error) const {
  std::vector<ClassBlock> blocks;  // copied: writing takes too long to hold up the map for
  double voxel_m = 0;
  {
    const std::shared_lock lock(impl_->mutex);
    voxel_m = impl_->voxel_m;
    for (const auto& [key, tile] : impl_->held.tiles())
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
