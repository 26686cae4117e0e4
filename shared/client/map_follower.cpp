#include "client/map_follower.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <random>

#include "bounds.h"
#include "map_codec/crc32c.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;

/// So long may what is held lag behind what the mapper says of the map.
constexpr auto kMayLag = 500ms;
/// Nothing has come for so long, and still it is not complete: something was lost.
constexpr auto kResyncAfter = 700ms;
constexpr int kResyncsUntilAnew = 3;
/// What could not be held is not asked for sooner.
constexpr auto kRest = 30s;

static_assert(int(Status::Hoist::kNotUsed) == v1::HOIST_NOT_USED &&
              int(Status::Hoist::kKnown) == v1::HOIST_KNOWN &&
              int(Status::Hoist::kLost) == v1::HOIST_LOST);
static_assert(int(Zone::Kind::kNoGo) == v1::ZONE_NO_GO &&
              int(Zone::Kind::kSlowDown) == v1::ZONE_SLOW_DOWN);

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

/// Key fields of the tile topics, as DDS writes them: crane, tile_x, tile_y, tile_z.
BandKey band_key(const dds::InstanceKey& k) {
  const auto at = [&k](std::size_t i) {
    return static_cast<std::int16_t>(static_cast<unsigned>(k[i]) << 8U | k[i + 1]);
  };
  return {at(4), at(6), at(8)};
}

std::uint64_t random_id() {
  std::random_device device;
  return std::uint64_t(device()) << 32U | device();
}

}  // namespace

MapFollower::MapFollower(std::shared_ptr<dds::Participant> participant,
                         dds::Reader<dds::MapTileTopic> voxels,
                         dds::Reader<dds::HeightTileTopic> heights,
                         dds::Reader<dds::MapStatusTopic> statuses,
                         dds::Reader<dds::ZoneSetTopic> zones,
                         dds::Writer<dds::TileRequestTopic> requests, std::size_t max_bytes)
    : participant_(std::move(participant)),
      voxel_reader_(std::move(voxels)),
      height_reader_(std::move(heights)),
      status_reader_(std::move(statuses)),
      zone_reader_(std::move(zones)),
      request_writer_(std::move(requests)),
      held_(0, max_bytes),
      client_(random_id()) {}

Result<std::unique_ptr<MapFollower>> MapFollower::create(
    const std::shared_ptr<dds::Participant>& participant, Wakeup* wakeup, std::size_t max_bytes) {
  auto voxels = dds::Reader<dds::MapTileTopic>::create(participant, wakeup);
  if (!voxels) return voxels.error();
  auto heights = dds::Reader<dds::HeightTileTopic>::create(participant, wakeup);
  if (!heights) return heights.error();
  auto statuses = dds::Reader<dds::MapStatusTopic>::create(participant, wakeup);
  if (!statuses) return statuses.error();
  auto zones = dds::Reader<dds::ZoneSetTopic>::create(participant, wakeup);
  if (!zones) return zones.error();
  auto requests = dds::Writer<dds::TileRequestTopic>::create(participant);
  if (!requests) return requests.error();
  return std::unique_ptr<MapFollower>(
      new MapFollower(participant, std::move(*voxels), std::move(*heights), std::move(*statuses),
                      std::move(*zones), std::move(*requests), max_bytes));
}

std::vector<TileKey> MapFollower::step() noexcept {
  try {
    return take_all();
  } catch (const std::exception& e) {
    give_up(e.what());
  } catch (...) {
    give_up("unknown");
  }
  return {};
}

/// What is held may be half of something: it goes, and with it the memory that it took.
void MapFollower::give_up(const char* why) noexcept {
  const std::unique_lock lock(mutex);
  held_ = nothing(held_.map_id());
  early_voxels_ = {};
  early_heights_ = {};
  changed_.clear();
  complete_at_ = {};
  rest_until_ = Steady::now() + kRest;
  try {
    trouble_ = std::string("the map could not be held here: ") + why;
  } catch (...) {
    trouble_ = "out of memory";  // short enough to need none
  }
}

std::vector<TileKey> MapFollower::take_all() {
  // First who is to be believed, and of what map; until that is known tiles stay where they are.
  while (const auto status = status_reader_.take()) take_status(*status);
  while (const auto set = zone_reader_.take()) take_zones(*set);
  if (said_) {
    while (const auto tile = voxel_reader_.take()) take_voxels(*tile);
    while (const auto tile = height_reader_.take()) take_heights(*tile);
  }
  const auto now = Steady::now();
  refuse(early_voxels_.end_waits(now) + early_heights_.end_waits(now));
  bool whole = false;
  {
    const std::unique_lock lock(mutex);
    whole = complete();
    if (whole) complete_at_ = now;
    if (whole) trouble_.clear();
  }
  if (whole)
    asked_in_vain_ = resyncs_in_vain_ = 0;
  else
    resync();
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  return std::exchange(changed_, {});
}

void MapFollower::refuse(std::size_t samples) {
  if (samples == 0) return;
  const std::unique_lock lock(mutex);
  refused_ += samples;
}

void MapFollower::take_voxels(const dds::Received<v1::MapTile>& received) {
  if (received.disposed()) {
    if (received.writer() != believed_) return refuse();
    const BandKey key = band_key(received.key());
    const std::unique_lock lock(mutex);
    held_.remove_voxels(key);
    changed_.push_back(key.tile());
    return;
  }
  if (!ours(*received)) return refuse();
  if (received.writer() != believed_)
    return refuse(early_voxels_.add(received.writer(), *received, Steady::now()));
  put(*received);
}

void MapFollower::put(const v1::MapTile& s) {
  if (s.map_id() != held_.map_id() || s.voxel_m() != voxel_m_ || crc32c(s.payload()) != s.crc32c())
    return refuse();
  auto decoded = decode_tile(s.payload(), s.tile_z());
  if (!decoded) return refuse();
  const BandKey key{s.tile_x(), s.tile_y(), s.tile_z()};
  auto voxels = held_.prepare(key, s.revision(), s.crc32c(), *decoded);
  const std::unique_lock lock(mutex);
  noted(held_.put(std::move(voxels)), key.tile());
}

void MapFollower::take_heights(const dds::Received<v1::HeightTile>& received) {
  if (received.disposed()) {
    if (received.writer() != believed_) return refuse();
    const TileKey key = band_key(received.key()).tile();
    const std::unique_lock lock(mutex);
    held_.remove_heights(key);
    changed_.push_back(key);
    return;
  }
  if (!ours(*received)) return refuse();
  if (received.writer() != believed_)
    return refuse(early_heights_.add(received.writer(), *received, Steady::now()));
  put(*received);
}

void MapFollower::put(const v1::HeightTile& s) {
  if (s.map_id() != held_.map_id() || s.voxel_m() != voxel_m_ || crc32c(s.payload()) != s.crc32c())
    return refuse();
  const auto decoded = decode_heights(s.payload());
  if (!decoded) return refuse();
  const TileKey key{s.tile_x(), s.tile_y()};
  HeightColumns heights{*decoded, {}, {}};
  heights.sum_up();
  const std::unique_lock lock(mutex);
  noted(held_.put(key, s.revision(), s.crc32c(), heights), key);
}

/// The caller holds the mutex.
void MapFollower::noted(Put put, TileKey key) {
  tile_at_ = Steady::now();
  if (put == Put::kHeld) return changed_.push_back(key);
  ++refused_;
  if (put == Put::kOlder) return;
  trouble_ = "the map needs more memory than the " + std::to_string(held_.max_bytes() >> 20U) +
             " MiB that it may take here";
  rest_until_ = Steady::now() + kRest;  // all of it again would not fit either
}

void MapFollower::take_zones(const dds::Received<v1::ZoneSet>& received) {
  if (!ours(*received)) return refuse();
  if (received.writer() != believed_) {  // of a mapper that begins; one is enough to wait
    early_zones_ = *received;
    early_zones_writer_ = received.writer();
    return;
  }
  if (received->map_id() != held_.map_id()) return refuse();
  auto zones = to_zones(*received);
  const std::unique_lock lock(mutex);
  held_.put(received->revision(), std::move(zones));
}

void MapFollower::take_status(const dds::Received<v1::MapStatus>& received) {
  const v1::MapStatus& s = *received;
  if (!ours(s)) return refuse();
  {
    const std::unique_lock lock(mutex);
    if (s.map_id() != held_.map_id() || s.voxel_m() != voxel_m_) {  // another map
      // All of it changes.
      for (const auto& [key, tile] : held_.tiles()) changed_.push_back(key);
      held_ = nothing(s.map_id());
      trouble_.clear();
      complete_at_ = rest_until_ = {};
      asked_in_vain_ = resyncs_in_vain_ = 0;
      tile_at_ = Steady::now();  // its tiles are on their way
    } else if (received.writer() != believed_) {
      held_.forget_revisions();
    }
    voxel_m_ = s.voxel_m();
    said_ = s;
    said_at_ = Steady::now();
    clock_offset_s_ = double(SystemClock().now() - s.time_ns()) * 1e-9;
  }
  if (received.writer() != believed_) believe(received.writer());
}

void MapFollower::believe(const dds::ParticipantId& writer) {
  believed_ = writer;
  for (const v1::MapTile& tile : early_voxels_.take(writer)) put(tile);
  for (const v1::HeightTile& tile : early_heights_.take(writer)) put(tile);
  if (!early_zones_ || early_zones_writer_ != writer) return;
  const v1::ZoneSet set = *std::exchange(early_zones_, std::nullopt);
  if (set.map_id() != held_.map_id()) return refuse();
  auto zones = to_zones(set);
  const std::unique_lock lock(mutex);
  held_.put(set.revision(), std::move(zones));
}

/// Asks for what is missing when nothing more seems to come.
void MapFollower::resync() {
  const auto now = Steady::now();
  // Who has asked in vain asks less and less often: its mapper answers with much more than that.
  const auto pause =
      kResyncAfter * (1 << std::clamp(resyncs_in_vain_ - 2 * kResyncsUntilAnew, 0, 5));
  if (!said_ || now < rest_until_ || now - said_at_ > 1s || now - tile_at_ < kResyncAfter ||
      now - complete_at_ < kResyncAfter || now - asked_at_ < pause)
    return;
  asked_at_ = now;
  v1::TileRequest request;
  {
    const std::unique_lock lock(mutex);
    // More than the map has, or what it no longer has, cannot be asked for: begin anew.
    if (++asked_in_vain_ > kResyncsUntilAnew) {
      for (const auto& [key, tile] : held_.tiles()) changed_.push_back(key);
      held_ = nothing(said_->map_id());
      asked_in_vain_ = 0;
    }
    ++resyncs_;
    ++resyncs_in_vain_;
    request.map_id(held_.map_id());
    request.voxel_digests() = held_.voxel_digests().buckets;
    request.height_digests() = held_.height_digests().buckets;
  }
  request.crane(participant_->settings().crane);
  request.client(client_);
  request.sequence_number(request_number_++);
  request.time_ns(SystemClock().now());
  (void)request_writer_.write(request);  // else again the next time
}

bool MapFollower::lately_complete() const {
  return Steady::now() - complete_at_ < kMayLag;
}

Status MapFollower::status() const {
  Status out;
  out.voxel_digest = held_.voxel_digests().all;
  out.height_digest = held_.height_digests().all;
  out.tiles = held_.voxel_tiles();
  out.zones_revision = held_.zones_revision();
  out.memory_bytes = held_.memory_bytes();
  out.samples_refused = refused_;
  out.resyncs = resyncs_;
  if (!said_) {
    out.reason = "no mapper heard yet";
    return out;
  }
  const v1::MapStatus& s = *said_;
  out.heard = true;
  out.alive = Steady::now() - said_at_ < 1s;
  out.valid = out.alive && s.validity() == 0 && trouble_.empty();
  out.complete = complete();
  out.reason = !out.alive         ? "no heartbeat of the mapper for more than 1 s"
               : trouble_.empty() ? s.reason().c_str()
                                  : trouble_;
  out.reason_code = s.reason_code();
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
  out.ceiling_m = s.ceiling_m();
  out.forget_s = s.forget_s();
  return out;
}

bool MapFollower::complete() const {
  return said_ && said_->map_id() == held_.map_id() &&
         said_->voxel_tiles() == held_.voxel_tiles() &&
         said_->height_tiles() == held_.height_tiles() &&
         said_->voxel_digest() == held_.voxel_digests().all &&
         said_->height_digest() == held_.height_digests().all &&
         said_->zones_revision() == held_.zones_revision();
}

}  // namespace crane::client
