#pragma once

#include <map>
#include <memory>

#include "base/stage_times.hpp"
#include "dds/endpoints.hpp"
#include "map_codec/octree_stream.hpp"
#include "mapper/map_builder.hpp"

namespace crane {

/// Hands the map on: changed tiles, the octree, the heartbeat. What it costs depends on what
/// changed; the octree alone on the size of the map. One thread.
class MapPublisher {
 public:
  struct Identity {
    std::uint64_t mapper = 0, map_id = 0;
    TimeNs mapper_start = 0;
  };

  static Result<MapPublisher> create(const std::shared_ptr<dds::Participant>& participant,
                                     const Identity& identity, bool paper_method);

  /// Publishes tiles whose content differs from what was last published, and clears their flags.
  /// Heights that only got a new age wait up to a second, unless `all` is set. Error: what DDS
  /// says.
  Result<void> publish_tiles(MapBuilder& builder, bool all);
  /// Whole octree, if the map changed since the last time.
  Result<void> publish_octree(MapBuilder& builder);
  /// `validity`: v1::STATUS_*.
  void publish_status(const MapBuilder& builder, double voxel_m, std::uint32_t validity,
                      const std::string& reason);

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  void restore_revision(std::uint64_t revision) { revision_ = revision; }
  [[nodiscard]] std::uint64_t published_tiles() const { return published_tiles_; }
  /// Waits until readers have all of the map.
  void flush(std::chrono::milliseconds limit);

  StageTimes stages;
  DropCounts dropped;

 private:
  struct Published {
    std::uint32_t voxel_crc = 0, height_crc = 0;
    TimeNs heights_time = 0;  ///< wall clock
  };
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
  std::map<TileKey, Published> published_;
  BtWriter bt_;
  std::uint64_t voxel_digest_ = 0, height_digest_ = 0;
  std::uint64_t revision_ = 0, octree_revision_ = 0, status_sequence_ = 0, published_tiles_ = 0;
};

}  // namespace crane
