// SPDX-License-Identifier: Apache-2.0
#include "map_sync/map_follower.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <random>
#include <utility>

#include "map_codec/crc32c.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// So long may what is held lag behind what the mapper says of the map.
constexpr auto kMayLag = 500ms;

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

template <class Tile>
bool intact(const Tile& s, std::uint64_t map_id, double voxel_m) {
  return s.map_id() == map_id && s.voxel_m() == voxel_m && crc32c(s.payload()) == s.crc32c();
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

std::vector<TileKey> MapFollower::take_all() {
  if (ended_) return {};
  if (participant_->ended()) {
    const std::unique_lock lock(mutex);
    ended_ = true;
    return {};
  }
  // First who is to be believed, and of what map. What nobody is believed for is taken as well, or
  // DDS would keep it, without a bound that is worth the name.
  while (const auto status = status_reader_.take()) take_status(*status);
  while (const auto set = zone_reader_.take()) take_zones(*set);
  while (const auto tile = voxel_reader_.take()) take_voxels(*tile);
  while (const auto tile = height_reader_.take()) take_heights(*tile);
  const auto now = Steady::now();
  refuse(early_voxels_.end_waits(now) + early_heights_.end_waits(now));
  look_for_a_second_mapper();
  if (complete()) {
    const std::unique_lock lock(mutex);
    complete_at_ = now;
    if (!two_mappers_) trouble_.clear();
    resync_.whole(now);
  } else {
    resync();
  }
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  return std::exchange(changed_, {});
}

// ---------------------------------------------------------------- who is believed, of what map

void MapFollower::take_status(const dds::Received<v1::MapStatus>& received) {
  const v1::MapStatus& s = *received;
  if (!ours(s)) return refuse();
  {
    const std::unique_lock lock(mutex);
    if (s.map_id() != held_.map_id() || s.voxel_m() != voxel_m_) {
      begin_anew(s.map_id());
      zones_.reset();
      if (!two_mappers_) trouble_.clear();
      complete_at_ = {};
      resync_.begins(Steady::now());
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
  if (const auto zones = early_zones_.extract(writer)) put(zones.mapped());
}

/// DDS hands on the strongest only, and who lies says it is that one.
void MapFollower::look_for_a_second_mapper() {
  const TimeNs long_ago = MonotonicClock().now() - std::chrono::nanoseconds(kTwoMappers).count();
  const auto writers = status_reader_.writers();
  const bool two = std::count_if(writers.begin(), writers.end(),
                                 [&](const auto& writer) { return writer.second < long_ago; }) > 1;
  if (two == two_mappers_) return;
  two_mappers_ = two;
  const std::unique_lock lock(mutex);
  trouble_ = two ? "two processes say that they are the mapper: see 'cranemap doctor'" : "";
}

// ---------------------------------------------------------------- what arrives

void MapFollower::take_zones(const dds::Received<v1::ZoneSet>& received) {
  if (!ours(*received)) return refuse();
  if (received.writer() == believed_) return put(*received);
  // They are said once: those of each are kept, whoever else says some, until it is known who
  // counts.
  constexpr std::size_t kMostWriters = 8;
  if (!early_zones_.contains(received.writer()) && early_zones_.size() >= kMostWriters) {
    early_zones_.erase(early_zones_.begin());
    refuse();
  }
  early_zones_[received.writer()] = *received;
}

void MapFollower::take_voxels(const dds::Received<v1::MapTile>& received) {
  const bool believed = received.writer() == believed_;
  if (received.disposed()) {
    if (!believed) return refuse();
    const BandKey key = band_key(received.key());
    const std::unique_lock lock(mutex);
    held_.remove_voxels(key);
    changed_.push_back(key.tile());
    return;
  }
  if (!ours(*received)) return refuse();
  if (believed) return put(*received);
  refuse(early_voxels_.add(received.writer(), *received, Steady::now()));
}

void MapFollower::take_heights(const dds::Received<v1::HeightTile>& received) {
  const bool believed = received.writer() == believed_;
  if (received.disposed()) {
    if (!believed) return refuse();
    const TileKey key = band_key(received.key()).tile();
    const std::unique_lock lock(mutex);
    held_.remove_heights(key);
    changed_.push_back(key);
    return;
  }
  if (!ours(*received)) return refuse();
  if (believed) return put(*received);
  refuse(early_heights_.add(received.writer(), *received, Steady::now()));
}

void MapFollower::put(const v1::MapTile& s) {
  if (!intact(s, held_.map_id(), voxel_m_)) return refuse();
  const auto decoded = decode_tile(s.payload(), s.tile_z());
  if (!decoded) return refuse();
  const BandKey key{s.tile_x(), s.tile_y(), s.tile_z()};
  auto voxels = held_.prepare(key, s.revision(), s.crc32c(), *decoded);
  const std::unique_lock lock(mutex);
  noted(held_.put(std::move(voxels)), key.tile());
}

void MapFollower::put(const v1::HeightTile& s) {
  if (!intact(s, held_.map_id(), voxel_m_)) return refuse();
  const auto decoded = decode_heights(s.payload());
  if (!decoded) return refuse();
  const TileKey key{s.tile_x(), s.tile_y()};
  HeightColumns heights{*decoded, {}, {}};
  heights.sum_up();
  const std::unique_lock lock(mutex);
  noted(held_.put(key, s.revision(), s.crc32c(), heights), key);
}

void MapFollower::put(const v1::ZoneSet& set) {
  if (set.map_id() != held_.map_id()) return refuse();
  const std::unique_lock lock(mutex);
  zones_ = set;
}

/// The caller holds the mutex.
void MapFollower::noted(Put put, TileKey key) {
  const auto now = Steady::now();
  resync_.arrived(now);
  if (put == Put::kHeld) return changed_.push_back(key);
  ++refused_;
  if (put == Put::kOlder) return;
  if (!two_mappers_)
    trouble_ = "the map needs more memory than the " + std::to_string(held_.max_bytes() >> 20U) +
               " MiB that it may take here";
  resync_.rests(now);  // all of it again would not fit either
}

void MapFollower::refuse(std::size_t samples) {
  if (samples == 0) return;
  const std::unique_lock lock(mutex);
  refused_ += samples;
}

// ---------------------------------------------------------------- what is missing

/// The caller holds the mutex. All of the old map changes.
void MapFollower::begin_anew(std::uint64_t map_id) {
  for (const auto& [key, tile] : held_.tiles()) changed_.push_back(key);
  held_ = HeldMap(map_id, held_.max_bytes());
}

/// What is held may be half of something: it goes, and with it the memory that it took.
void MapFollower::give_up(const char* why) noexcept {
  const std::unique_lock lock(mutex);
  held_ = HeldMap(held_.map_id(), held_.max_bytes());
  zones_.reset();
  early_voxels_.clear();
  early_heights_.clear();
  early_zones_.clear();
  changed_.clear();
  complete_at_ = {};
  resync_.rests(Steady::now());
  try {
    trouble_ = std::string("the map could not be held here: ") + why;
  } catch (...) {
    trouble_ = "out of memory";  // short enough to need none
  }
}

void MapFollower::resync() {
  const auto ask = said_ ? resync_.due(Steady::now(), said_at_) : Resync::Ask::kNot;
  if (ask == Resync::Ask::kNot) return;
  v1::TileRequest request;
  {
    const std::unique_lock lock(mutex);
    if (ask == Resync::Ask::kForAll) begin_anew(held_.map_id());
    ++resyncs_;
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

bool MapFollower::complete() const {
  return said_ && said_->map_id() == held_.map_id() &&
         said_->voxel_tiles() == held_.voxel_tiles() &&
         said_->height_tiles() == held_.height_tiles() &&
         said_->voxel_digest() == held_.voxel_digests().all &&
         said_->height_digest() == held_.height_digests().all &&
         said_->zones_revision() == zones_revision();
}

}  // namespace crane
