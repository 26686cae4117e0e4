// SPDX-License-Identifier: Apache-2.0
#include "mapper/map_publisher.hpp"

#include <algorithm>

#include "bounds.h"
#include "dds/validate.hpp"
#include "map_codec/crc32c.hpp"

namespace crane {
namespace {

constexpr int kOctreeLevel = 3;
static_assert(int(HoistKnown::kNotUsed) == v1::HOIST_NOT_USED &&
              int(HoistKnown::kKnown) == v1::HOIST_KNOWN &&
              int(HoistKnown::kLost) == v1::HOIST_LOST);
static_assert(kBuckets == v1::TILE_BUCKETS);

template <class Type>
void set_key(Type& sample, std::uint32_t crane, TileKey key) {
  sample.crane(crane);
  sample.tile_x(static_cast<std::int16_t>(key.x));
  sample.tile_y(static_cast<std::int16_t>(key.y));
}

BandKey band_key(TileKey key, int band) {
  return {static_cast<std::int16_t>(key.x), static_cast<std::int16_t>(key.y),
          static_cast<std::int16_t>(band)};
}

}  // namespace

Result<MapPublisher> MapPublisher::create(const std::shared_ptr<dds::Participant>& participant,
                                          const Identity& identity, bool paper_method) {
  const auto make = [&]<class Topic>(Topic) {
    return dds::Writer<Topic>::create(participant, Topic::kName, identity.term);
  };
  auto tiles = make(dds::MapTileTopic{});
  if (!tiles) return tiles.error();
  auto heights = make(dds::HeightTileTopic{});
  if (!heights) return heights.error();
  auto octree = make(dds::OctreeMapTopic{});
  if (!octree) return octree.error();
  MapPublisher p(std::move(*tiles), std::move(*heights), std::move(*octree));
  p.crane_ = participant->settings().crane;
  p.identity_ = identity;
  p.paper_method_ = paper_method;
  return p;
}

Result<void> MapPublisher::publish_voxels(const Tile& tile, const Stamp& stamp,
                                          Published& published) {
  const std::vector<int> known = known_bands(tile);
  v1::MapTile sample;
  set_key(sample, crane_, tile.key);
  sample.map_id(identity_.map_id);
  sample.revision(stamp.revision);
  sample.time_ns(stamp.time);
  sample.voxel_m(stamp.voxel_m);
  sample.encoding(kTileEncoding);
  for (const int band : known) {
    Bytes payload = encode_tile(tile, band);
    const std::uint32_t crc = crc32c(payload);
    const auto old = published.bands.find(band);
    const bool fresh = old == published.bands.end();
    if (!fresh && old->second == crc && !stamp.again) continue;
    sample.tile_z(static_cast<std::int16_t>(band));
    sample.crc32c(crc);
    sample.payload(std::move(payload));
    if (auto sent = tiles_.write(sample); !sent) return sent;
    const BandKey key = band_key(tile.key, band);
    if (fresh)
      ++voxel_tiles_;
    else
      voxel_digests_.remove(key, old->second);
    voxel_digests_.add(key, crc);
    published.bands[band] = crc;
    revision_ = stamp.revision;
    ++published_tiles_;
  }
  for (auto old = published.bands.begin(); old != published.bands.end();) {
    if (std::find(known.begin(), known.end(), old->first) != known.end()) {
      ++old;
      continue;
    }
    sample.tile_z(static_cast<std::int16_t>(old->first));
    if (auto ended = tiles_.dispose(sample); !ended) return ended;
    voxel_digests_.remove(band_key(tile.key, old->first), old->second);
    --voxel_tiles_;
    revision_ = stamp.revision;
    old = published.bands.erase(old);
  }
  return {};
}

Result<void> MapPublisher::publish_heights(const OccupancyMap& map, const Tile& tile,
                                           const Stamp& stamp, Published& published) {
  published.heights_time = MonotonicClock().now();
  const TileHeights heights = tile_heights(map, tile, floor_tolerance_m(map.voxel_m()));
  if (!any_known(heights) && !published.heights) return {};
  v1::HeightTile sample;
  set_key(sample, crane_, tile.key);
  const BandKey key = band_key(tile.key, 0);
  Bytes payload = encode_heights(heights);
  const std::uint32_t crc = crc32c(payload);
  if (published.heights == crc && !stamp.again) return {};
  sample.map_id(identity_.map_id);
  sample.revision(stamp.revision);
  sample.time_ns(stamp.time);
  sample.voxel_m(stamp.voxel_m);
  sample.encoding(kTileEncoding);
  sample.crc32c(crc);
  sample.payload(std::move(payload));
  if (auto sent = heights_.write(sample); !sent) return sent;
  if (published.heights)
    height_digests_.remove(key, *published.heights);
  else
    ++height_tiles_;
  height_digests_.add(key, crc);
  published.heights = crc;
  revision_ = stamp.revision;
  return {};
}

Result<void> MapPublisher::publish_tiles(MappingPipeline& pipeline, bool all, double budget_ms) {
  const Stopwatch watch;
  OccupancyMap& map = pipeline.map();
  const Stamp stamp{revision_ + 1, pipeline.account().last_frame_time, map.voxel_m()};
  std::vector<Tile*> changed = map.changed_tiles();
  // Where the last call ended, so that none waits for ever behind those that change all the time.
  std::rotate(changed.begin(),
              std::find_if(changed.begin(), changed.end(),
                           [this](const Tile* t) { return resume_at_ < t->key; }),
              changed.end());
  for (Tile* tile : changed) {
    behind_ = !all && tile != changed.front() && watch.ms() >= budget_ms;
    if (behind_) break;
    resume_at_ = tile->key;
    const auto [it, fresh] = published_.try_emplace(tile->key);
    if (fresh || tile->reclassified) {
      bt_.changed(tile->key);
      if (auto sent = publish_voxels(*tile, stamp, it->second); !sent) return sent;
    }
    // Heights that moved go out at once; those only seen again, with a new age, once a second.
    const bool refresh = all || MonotonicClock().now() - it->second.heights_time > kNsPerSecond;
    if (!fresh && !tile->reclassified && !tile->moved && !refresh) continue;
    if (auto sent = publish_heights(map, *tile, stamp, it->second); !sent) return sent;
    tile->changed = tile->reclassified = tile->moved = false;
  }
  stages_.push_back({"publish tiles", watch.ms()});
  return {};
}

void MapPublisher::note_request(const v1::TileRequest& request) {
  if (request.map_id() != identity_.map_id) return;
  owed_.note(request.voxel_digests(), request.height_digests(), voxel_digests_, height_digests_,
             published_, OwedTiles::Clock::now());
}

Result<void> MapPublisher::send_again(MappingPipeline& pipeline, double budget_ms) {
  const Stopwatch watch;
  const OccupancyMap& map = pipeline.map();
  const Stamp stamp{revision_, pipeline.account().last_frame_time, map.voxel_m(), true};
  for (bool more = true; more && !owed_.empty(); more = watch.ms() < budget_ms) {
    const auto [key, lack] = *owed_.next(OwedTiles::Clock::now());
    const Tile* tile = map.find(key);
    const auto published = published_.find(key);
    if (tile == nullptr || published == published_.end()) continue;
    if (lack.voxels)
      if (auto sent = publish_voxels(*tile, stamp, published->second); !sent) return sent;
    if (lack.heights && published->second.heights)
      if (auto sent = publish_heights(map, *tile, stamp, published->second); !sent) return sent;
    counts_.add(Cause::kTilesSentAgain);
  }
  return {};
}

Result<void> MapPublisher::publish_octree(MappingPipeline& pipeline) {
  if (octree_revision_ == revision_) return {};
  const Stopwatch watch;
  const Bytes file = bt_.write(pipeline.map());
  Bytes payload = compress(file, kOctreeLevel);
  octree_revision_ = revision_;
  if (payload.size() > v1::MAX_OCTREE_BYTES || file.size() > dds::kMaxOctreeDecoded) {
    counts_.add(Cause::kOctreeTooLarge);
    return {};
  }
  v1::OctreeMap sample;
  sample.crane(crane_);
  sample.map_id(identity_.map_id);
  sample.revision(revision_);
  sample.time_ns(pipeline.account().last_frame_time);
  sample.voxel_m(pipeline.voxel_m());
  sample.encoding(1);
  sample.crc32c(crc32c(payload));
  sample.decoded_bytes(static_cast<std::uint32_t>(file.size()));
  sample.payload(std::move(payload));
  auto sent = octree_.write(sample);
  stages_.push_back({"publish octree", watch.ms()});
  return sent;
}

v1::MapStatus MapPublisher::status(const MappingPipeline& pipeline, const Health& health) const {
  const FrameAccount& account = pipeline.account();
  v1::MapStatus s;
  s.crane(crane_);
  s.mapper(identity_.mapper);
  s.mapper_start_ns(identity_.mapper_start);
  s.map_id(identity_.map_id);
  s.revision(revision_);
  s.zones_revision(health.zones_revision);
  s.voxel_digest(voxel_digests_.all);
  s.height_digest(height_digests_.all);
  s.voxel_tiles(voxel_tiles_);
  s.height_tiles(height_tiles_);
  s.voxel_m(pipeline.voxel_m());
  s.validity(health.validity);
  s.reason_code(health.reason_code);
  s.paper_method(paper_method_ ? 1 : 0);
  s.hoist(static_cast<std::uint32_t>(pipeline.report().hoist));
  s.term(static_cast<std::uint32_t>(identity_.term));
  s.ceiling_m(pipeline.ceiling_m());
  s.forget_s(health.forget_s);
  s.stream(account.stream);
  s.last_frame(account.last_frame < 0 ? 0 : static_cast<std::uint64_t>(account.last_frame));
  s.last_frame_time_ns(account.last_frame_time);
  s.frames_integrated(account.integrated);
  s.frames_rejected(account.rejected);
  s.frames_missing(account.missing);
  s.reason(health.reason.substr(0, 255).c_str());
  return s;
}

void MapPublisher::flush(std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  const auto left = [end] {
    return std::max(std::chrono::milliseconds(0),
                    std::chrono::duration_cast<std::chrono::milliseconds>(
                        end - std::chrono::steady_clock::now()));
  };
  (void)tiles_.wait_for_readers(left());
  (void)heights_.wait_for_readers(left());
  (void)octree_.wait_for_readers(left());
}

}  // namespace crane
