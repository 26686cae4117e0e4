#include "crane/client/map.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "client/clearance_check.hpp"
#include "client/column_tile.hpp"
#include "dds/endpoints.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/tile_codec.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

/// So long may what is held lag behind what the mapper says of the map.
constexpr auto kMayLag = 500ms;

template <class Content>
struct Held {
  std::uint64_t revision = 0;
  std::uint32_t crc = 0;
  Content content;
};

Result<ColumnTile> decode_columns(std::span<const std::uint8_t> payload) {
  auto tile = decode_tile(payload);
  if (!tile) return tile.error();
  return columns_of(*tile);
}

/// Tiles of one kind with the digest over them.
template <class Content>
struct Layer {
  std::map<TileKey, Held<Content>> tiles;
  std::uint64_t digest = 0;

  void put(TileKey key, Held<Content> held) {
    const auto it = tiles.find(key);
    if (it != tiles.end()) digest -= tile_digest(key, it->second.crc);
    digest += tile_digest(key, held.crc);
    tiles[key] = std::move(held);
  }
  [[nodiscard]] const Content* find(TileKey key) const {
    const auto it = tiles.find(key);
    return it == tiles.end() ? nullptr : &it->second.content;
  }
  void clear() {
    tiles.clear();
    digest = 0;
  }
};

}  // namespace

struct Map::Impl {
  std::shared_ptr<dds::Participant> participant;
  Wakeup wakeup;
  std::optional<dds::Reader<dds::MapTileTopic>> voxel_reader;
  std::optional<dds::Reader<dds::HeightTileTopic>> height_reader;
  std::optional<dds::Reader<dds::MapStatusTopic>> status_reader;

  mutable std::mutex mutex;
  Layer<ColumnTile> voxels;
  Layer<TileHeights> heights;
  std::uint64_t map_id = 0;
  double voxel_m = 0;
  std::uint64_t refused = 0;
  std::optional<v1::MapStatus> said;
  Steady::time_point said_at{}, complete_at{};

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
      while (const auto tile = voxel_reader->take()) take(**tile, voxels, decode_columns);
      while (const auto tile = height_reader->take()) take(**tile, heights, decode_heights);
      while (const auto status = status_reader->take()) {
        const std::lock_guard lock(mutex);
        said = **status;
        said_at = Steady::now();
        follow(said->map_id(), said->voxel_m());
      }
      const std::lock_guard lock(mutex);
      if (complete()) complete_at = Steady::now();
    }
  }

  /// Another map: what is held belongs to the old one.
  void follow(std::uint64_t id, double voxel) {
    if (id == map_id) return;
    voxels.clear();
    heights.clear();
    map_id = id;
    voxel_m = voxel;
    complete_at = {};
  }

  template <class Sample, class Content, class Decode>
  void take(const Sample& s, Layer<Content>& layer, Decode decode) {
    auto content =
        crc32c(s.payload()) == s.crc32c()
            ? decode(std::span<const std::uint8_t>(s.payload()))
            : Result<Content>(Error{ErrorCode::kBadData, "tile", "fails its checksum", ""});
    const std::lock_guard lock(mutex);
    if (!content) {
      ++refused;
      return;
    }
    follow(s.map_id(), s.voxel_m());
    layer.put({s.tile_x(), s.tile_y()}, {s.revision(), s.crc32c(), std::move(*content)});
  }

  /// Caller holds the mutex.
  [[nodiscard]] Status status() const {
    Status out;
    out.voxel_digest = voxels.digest;
    out.height_digest = heights.digest;
    out.tiles = static_cast<std::uint32_t>(voxels.tiles.size());
    out.samples_refused = refused;
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
    out.map_id = s.map_id();
    out.revision = s.revision();
    out.voxel_m = s.voxel_m();
    out.stream = s.stream();
    out.last_frame = s.last_frame();
    out.last_frame_time_ns = s.last_frame_time_ns();
    out.frames_integrated = s.frames_integrated();
    out.frames_rejected = s.frames_rejected();
    out.frames_missing = s.frames_missing();
    return out;
  }

  /// Caller holds the mutex.
  [[nodiscard]] bool complete() const {
    return said && said->map_id() == map_id && said->voxel_tiles() == voxels.tiles.size() &&
           said->height_tiles() == heights.tiles.size() && said->voxel_digest() == voxels.digest &&
           said->height_digest() == heights.digest;
  }
};

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Map::~Map() = default;

std::unique_ptr<Map> Map::join(const Options& options, std::string& error) {
  dds::Settings settings;
  settings.crane = options.crane;
  settings.domain = options.domain;
  settings.transport = options.udp_only ? dds::Transport::kUdp : dds::Transport::kAuto;
  settings.interfaces = options.interfaces;
  settings.profile_file = options.profile_file;
  settings.profile_name = options.profile_name;
  auto impl = std::make_unique<Impl>();
  auto participant = dds::Participant::create(settings, "cranemap-client");
  if (!participant) {
    error = participant.error().text();
    return nullptr;
  }
  impl->participant = *participant;
  auto voxels = dds::Reader<dds::MapTileTopic>::create(impl->participant, &impl->wakeup);
  auto heights = dds::Reader<dds::HeightTileTopic>::create(impl->participant, &impl->wakeup);
  auto status = dds::Reader<dds::MapStatusTopic>::create(impl->participant, &impl->wakeup);
  if (!voxels || !heights || !status) {
    error = (!voxels ? voxels.error() : !heights ? heights.error() : status.error()).text();
    return nullptr;
  }
  impl->voxel_reader.emplace(std::move(*voxels));
  impl->height_reader.emplace(std::move(*heights));
  impl->status_reader.emplace(std::move(*status));
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Map>(new Map(std::move(impl)));
}

Status Map::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->status();
}

bool Map::wait_until_complete(std::chrono::milliseconds limit) const {
  for (const auto end = Steady::now() + limit; Steady::now() < end;) {
    {
      const std::lock_guard lock(impl_->mutex);
      if (impl_->complete()) return true;
    }
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

Height Map::height(double x_m, double y_m) const {
  const std::lock_guard lock(impl_->mutex);
  if (!(impl_->voxel_m > 0) || !(std::abs(x_m) < 1e6) || !(std::abs(y_m) < 1e6)) return {};
  const int x = static_cast<int>(std::floor(x_m / impl_->voxel_m));
  const int y = static_cast<int>(std::floor(y_m / impl_->voxel_m));
  const auto it = impl_->heights.tiles.find({tile_of(x), tile_of(y)});
  if (it == impl_->heights.tiles.end()) return {};
  const ColumnHeight& c =
      it->second.content[static_cast<std::size_t>(in_tile(y) * kTileEdge + in_tile(x))];
  return {static_cast<Surface>(c.state), c.height_m, c.spread_m, c.last_observed};
}

HeightGrid Map::heights() const {
  const std::lock_guard lock(impl_->mutex);
  HeightGrid grid;
  const auto& tiles = impl_->heights.tiles;
  if (tiles.empty()) return grid;
  TileKey low = tiles.begin()->first;
  TileKey high = low;
  for (const auto& [key, held] : tiles) {
    low = {std::min(low.x, key.x), std::min(low.y, key.y)};
    high = {std::max(high.x, key.x), std::max(high.y, key.y)};
  }
  grid.cell_m = impl_->voxel_m;
  grid.origin_x_m = low.x * kTileEdge * grid.cell_m;
  grid.origin_y_m = low.y * kTileEdge * grid.cell_m;
  grid.columns = static_cast<std::uint32_t>((high.x - low.x + 1) * kTileEdge);
  grid.rows = static_cast<std::uint32_t>((high.y - low.y + 1) * kTileEdge);
  grid.cells.resize(std::size_t(grid.columns) * grid.rows);
  for (const auto& [key, held] : tiles)
    for (std::size_t i = 0; i < kTileColumns; ++i) {
      const ColumnHeight& c = held.content[i];
      const std::size_t column = std::size_t(key.x - low.x) * kTileEdge + i % kTileEdge;
      const std::size_t row = std::size_t(key.y - low.y) * kTileEdge + i / kTileEdge;
      grid.cells[row * grid.columns + column] = {static_cast<Surface>(c.state), c.height_m,
                                                 c.spread_m, c.last_observed};
    }
  return grid;
}

AreaHeight Map::max_height(const Area& area) const {
  const std::lock_guard lock(impl_->mutex);
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
    const TileHeights* tile = nullptr;
    for (int x = index(area.x0_m); x <= index(area.x1_m); ++x) {
      if (x == index(area.x0_m) || in_tile(x) == 0)
        tile = impl_->heights.find({tile_of(x), tile_of(y)});
      ++columns;
      const ColumnHeight* c =
          tile != nullptr ? &(*tile)[std::size_t(in_tile(y) * kTileEdge + in_tile(x))] : nullptr;
      if (c == nullptr || c->state == ColumnState::kUnknown) {
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
  const std::lock_guard lock(impl_->mutex);
  const Status now = impl_->status();
  // While the tiles of a new revision arrive, what is held is that of the last one.
  const bool lately = Steady::now() - impl_->complete_at < kMayLag;
  if (!now.valid || !(now.complete || lately)) {
    out.reason = Reason::kMapInvalid;
    out.text = !now.valid ? now.reason : "not all tiles of the map have arrived";
    return out;
  }
  const ColumnView view{impl_->voxel_m, [this](TileKey key) { return impl_->voxels.find(key); },
                        [this](TileKey key) { return impl_->heights.find(key); }};
  out = check_clearance(query, view, query.now_ns != 0 ? query.now_ns : SystemClock().now());
  out.map_id = impl_->map_id;
  out.revision = now.revision;
  return out;
}

Map::VoxelCount Map::count_voxels() const {
  const std::lock_guard lock(impl_->mutex);
  VoxelCount count;
  for (const auto& [key, held] : impl_->voxels.tiles) {
    for (const std::uint64_t bits : held.content.occupied)
      count.occupied += static_cast<unsigned>(__builtin_popcountll(bits));
    for (const std::uint64_t bits : held.content.free)
      count.free += static_cast<unsigned>(__builtin_popcountll(bits));
  }
  return count;
}

}  // namespace crane::client
