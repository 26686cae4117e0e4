#include "mapper/map_publisher.hpp"

#include "bounds.h"
#include "map_codec/crc32c.hpp"
#include "map_codec/tile_codec.hpp"

namespace crane {
namespace {

constexpr int kOctreeLevel = 3;

template <class Type>
Type tile_sample(std::uint32_t crane, TileKey key, std::uint64_t map_id, std::uint64_t revision,
                 TimeNs time, double voxel_m, Bytes payload, std::uint32_t crc) {
  Type sample;
  sample.crane(crane);
  sample.tile_x(key.x);
  sample.tile_y(key.y);
  sample.map_id(map_id);
  sample.revision(revision);
  sample.time_ns(time);
  sample.voxel_m(voxel_m);
  sample.encoding(kTileEncoding);
  sample.crc32c(crc);
  sample.payload(std::move(payload));
  return sample;
}

Error too_big() {
  return {ErrorCode::kResource, "map_tile", "a tile exceeds its bound",
          "raise mapper.voxel_m or lower z_max_m"};
}

}  // namespace

Result<MapPublisher> MapPublisher::create(const std::shared_ptr<dds::Participant>& participant,
                                          const Identity& identity, bool paper_method) {
  auto tiles = dds::Writer<dds::MapTileTopic>::create(participant);
  if (!tiles) return tiles.error();
  auto heights = dds::Writer<dds::HeightTileTopic>::create(participant);
  if (!heights) return heights.error();
  auto octree = dds::Writer<dds::OctreeMapTopic>::create(participant);
  if (!octree) return octree.error();
  auto status = dds::Writer<dds::MapStatusTopic>::create(participant);
  if (!status) return status.error();
  MapPublisher p(std::move(*tiles), std::move(*heights), std::move(*octree), std::move(*status));
  p.crane_ = participant->settings().crane;
  p.identity_ = identity;
  p.paper_method_ = paper_method;
  return p;
}

Result<void> MapPublisher::publish_tiles(MapBuilder& builder, bool all) {
  const Stopwatch watch;
  OccupancyMap& map = builder.map();
  const std::uint64_t revision = revision_ + 1;
  const TimeNs time = builder.account().last_frame_time;
  for (Tile* tile : map.changed_tiles()) {
    const auto [it, fresh] = published_.try_emplace(tile->key);
    Published& old = it->second;
    if (fresh || tile->reclassified) {
      bt_.changed(tile->key);
      Bytes voxels = encode_tile(*tile);
      if (voxels.size() > v1::MAX_TILE_BYTES) return too_big();
      const std::uint32_t crc = crc32c(voxels);
      if (fresh || old.voxel_crc != crc) {
        auto sent =
            tiles_.write(tile_sample<v1::MapTile>(crane_, tile->key, identity_.map_id, revision,
                                                  time, map.voxel_m(), std::move(voxels), crc));
        if (!sent) return sent;
        voxel_digest_ +=
            tile_digest(tile->key, crc) - (fresh ? 0 : tile_digest(tile->key, old.voxel_crc));
        old.voxel_crc = crc;
        revision_ = revision;
        ++published_tiles_;
      }
    }
    // Heights that moved go out at once; those only seen again, with a new age, once a second.
    const TimeNs now = SystemClock().now();
    const bool refresh = all || now - old.heights_time > kNsPerSecond;
    if (!fresh && !tile->reclassified && !tile->moved && !refresh) continue;
    old.heights_time = now;
    Bytes heights = encode_heights(tile_heights(map, *tile, floor_tolerance_m(map.voxel_m())));
    if (heights.size() > v1::MAX_HEIGHT_TILE_BYTES) return too_big();
    const std::uint32_t crc = crc32c(heights);
    if (fresh || old.height_crc != crc) {
      auto sent =
          heights_.write(tile_sample<v1::HeightTile>(crane_, tile->key, identity_.map_id, revision,
                                                     time, map.voxel_m(), std::move(heights), crc));
      if (!sent) return sent;
      height_digest_ +=
          tile_digest(tile->key, crc) - (fresh ? 0 : tile_digest(tile->key, old.height_crc));
      old.height_crc = crc;
      revision_ = revision;
    }
    tile->changed = tile->reclassified = tile->moved = false;
  }
  stages.add("publish tiles", watch.ms());
  return {};
}

Result<void> MapPublisher::publish_octree(MapBuilder& builder) {
  if (octree_revision_ == revision_) return {};
  const Stopwatch watch;
  const Bytes file = bt_.write(builder.map());
  Bytes payload = compress(file, kOctreeLevel);
  octree_revision_ = revision_;
  if (payload.size() > v1::MAX_OCTREE_BYTES) {
    dropped.add("octree larger than its bound");
    return {};
  }
  v1::OctreeMap sample;
  sample.crane(crane_);
  sample.map_id(identity_.map_id);
  sample.revision(revision_);
  sample.time_ns(builder.account().last_frame_time);
  sample.voxel_m(builder.voxel_m());
  sample.encoding(1);
  sample.crc32c(crc32c(payload));
  sample.decoded_bytes(static_cast<std::uint32_t>(file.size()));
  sample.payload(std::move(payload));
  auto sent = octree_.write(sample);
  stages.add("publish octree", watch.ms());
  return sent;
}

void MapPublisher::publish_status(const MapBuilder& builder, double voxel_m, std::uint32_t validity,
                                  const std::string& reason) {
  const FrameAccount& account = builder.account();
  v1::MapStatus s;
  s.crane(crane_);
  s.sequence_number(status_sequence_++);
  s.time_ns(SystemClock().now());
  s.mapper(identity_.mapper);
  s.mapper_start_ns(identity_.mapper_start);
  s.map_id(identity_.map_id);
  s.revision(revision_);
  s.voxel_digest(voxel_digest_);
  s.height_digest(height_digest_);
  s.voxel_tiles(static_cast<std::uint32_t>(published_.size()));
  s.height_tiles(static_cast<std::uint32_t>(published_.size()));
  s.voxel_m(voxel_m);
  s.validity(validity);
  s.paper_method(paper_method_ ? 1 : 0);
  s.stream(account.stream);
  s.last_frame(account.last_frame < 0 ? 0 : static_cast<std::uint64_t>(account.last_frame));
  s.last_frame_time_ns(account.last_frame_time);
  s.frames_integrated(account.integrated);
  s.frames_rejected(account.rejected);
  s.frames_missing(account.missing);
  s.reason(reason.substr(0, 255).c_str());
  if (auto sent = status_.write(s); !sent) dropped.add("map_status not accepted by DDS");
}

void MapPublisher::flush(std::chrono::milliseconds limit) {
  (void)tiles_.wait_for_readers(limit);
  (void)heights_.wait_for_readers(limit);
  (void)octree_.wait_for_readers(limit);
  (void)status_.wait_for_readers(limit);
}

}  // namespace crane
