#pragma once

#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "base/stage_times.hpp"
#include "dds/endpoints.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapper/map_builder.hpp"

namespace crane {

/// Hands the map on: changed tiles, the octree, the heartbeat. What it costs depends on what
/// changed; the octree alone on the size of the map. One thread.
class MapPublisher {
 public:
  struct Identity {
    std::uint64_t mapper = 0, map_id = 0;
    TimeNs mapper_start = 0;
    int term = 0;  ///< ownership strength: readers hear the highest
  };

  static Result<MapPublisher> create(const std::shared_ptr<dds::Participant>& participant,
                                     const Identity& identity, bool paper_method);

  /// Publishes tiles whose content differs from what was last published, and clears their flags.
  /// Heights that only got a new age wait up to a second, unless `all` is set. Error: what DDS
  /// says.
  Result<void> publish_tiles(MapBuilder& builder, bool all);
  /// Sends again what a subscriber lacks, by the digests of what it holds. Error: what DDS says.
  Result<void> send_again(MapBuilder& builder, const v1::TileRequest& request);
  /// Whole octree, if the map changed since the last time.
  Result<void> publish_octree(MapBuilder& builder);
  struct Health {
    std::uint32_t validity = 0;  ///< v1::STATUS_*
    std::string reason;          ///< why not valid
    std::uint64_t zones_revision = 0;
    double forget_s = 0;
  };
  void publish_status(const MapBuilder& builder, const Health& health);
  /// Another mapper's last heartbeat as ours: we hold what it served, and its tiles follow.
  void take_over(v1::MapStatus last);

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  void restore_revision(std::uint64_t revision) { revision_ = revision; }
  [[nodiscard]] std::uint64_t published_tiles() const { return published_tiles_; }
  /// Waits until readers have all of the map.
  void flush(std::chrono::milliseconds limit);

  StageTimes stages;
  DropCounts dropped;

 private:
  /// What the network has of a tile.
  struct Published {
    std::map<int, std::uint32_t> bands;    ///< their checksums
    std::optional<std::uint32_t> heights;  ///< its checksum
    TimeNs heights_time = 0;               ///< monotonic
  };
  /// One change of the map, as its samples are stamped.
  struct Stamp {
    std::uint64_t revision = 0;
    TimeNs time = 0;
    double voxel_m = 0;
    bool again = false;  ///< what has not changed is sent, too
  };
  Result<void> publish_voxels(const Tile& tile, const Stamp& stamp, Published& published);
  Result<void> publish_heights(const OccupancyMap& map, const Tile& tile, const Stamp& stamp,
                               Published& published);
  MapPublisher(dds::Writer<dds::MapTileTopic> tiles, dds::Writer<dds::HeightTileTopic> heights,
               dds::Writer<dds::OctreeMapTopic> octree, dds::Writer<dds::MapStatusTopic> status)
      : tiles_(std::move(tiles)),
        heights_(std::move(heights)),
        octree_(std::move(octree)),
        status_(std::move(status)) {}

  dds::Writer<dds::MapTileTopic> tiles_;
  dds::Writer<dds::HeightTileTopic> heights_;
  dds::Writer<dds::OctreeMapTopic> octree_;
  dds::Writer<dds::MapStatusTopic> status_;
  std::uint32_t crane_ = 0;
  Identity identity_;
  bool paper_method_ = false;
  std::unordered_map<TileKey, Published, TileKeyHash> published_;
  BtWriter bt_;
  BucketDigests voxel_digests_, height_digests_;
  std::uint32_t voxel_tiles_ = 0, height_tiles_ = 0;
  std::uint64_t revision_ = 0, octree_revision_ = 0, status_sequence_ = 0, published_tiles_ = 0;
};

}  // namespace crane
