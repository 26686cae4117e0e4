// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dds/endpoints.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "map_sync/owed_tiles.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"

namespace crane {

/// Hands the map on: changed tiles and the octree. What it costs depends on what changed; the
/// octree alone on the size of the map. A call for tiles ends within its budget, and the next one
/// goes on. One thread.
class MapPublisher {
 public:
  struct Identity {
    std::uint64_t mapper = 0, map_id = 0;
    TimeNs mapper_start = 0;
    int term = 0;  ///< ownership strength: readers hear the highest
  };
  /// Of a call, beside the tile that it is at. A frame waits no longer.
  static constexpr double kBudgetMs = 40;

  static Result<MapPublisher> create(const std::shared_ptr<dds::Participant>& participant,
                                     const Identity& identity, bool paper_method);

  /// Publishes tiles whose content differs from what was last published, and clears their flags.
  /// Heights that only got a new age wait up to a second, unless `all` is set: then all goes out,
  /// however long it takes. Error: what DDS says.
  Result<void> publish_tiles(MappingPipeline& pipeline, bool all, double budget_ms = kBudgetMs);
  /// Whether the budget ended the last call for tiles before its end.
  [[nodiscard]] bool behind() const { return behind_; }
  /// Notes what a subscriber lacks, by the digests of what it holds.
  void note_request(const v1::TileRequest& request);
  /// Sends what was noted, as much as the budget allows. Error: what DDS says.
  Result<void> send_again(MappingPipeline& pipeline, double budget_ms = kBudgetMs);
  /// Whether something noted is still to be sent.
  [[nodiscard]] bool owes() const { return !owed_.empty(); }
  /// Whole octree, if the map changed since the last time.
  Result<void> publish_octree(MappingPipeline& pipeline);

  struct Health {
    std::uint32_t validity = 0;     ///< v1::STATUS_*
    std::uint32_t reason_code = 0;  ///< v1::MAP_*
    std::string reason;             ///< the same in words
    std::uint64_t zones_revision = 0;
    double forget_s = 0;
  };
  /// What is to be said of the map as it has been published.
  [[nodiscard]] v1::MapStatus status(const MappingPipeline& pipeline, const Health& health) const;

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  void restore_revision(std::uint64_t revision) { revision_ = revision; }
  [[nodiscard]] std::uint64_t published_tiles() const { return published_tiles_; }
  /// Waits until readers have all of the map.
  void flush(std::chrono::milliseconds limit);
  [[nodiscard]] const DropCounts& counts() const { return counts_; }
  /// What the calls since the last one took.
  std::vector<StageMs> take_stages() { return std::exchange(stages_, {}); }

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
               dds::Writer<dds::OctreeMapTopic> octree)
      : tiles_(std::move(tiles)), heights_(std::move(heights)), octree_(std::move(octree)) {}

  dds::Writer<dds::MapTileTopic> tiles_;
  dds::Writer<dds::HeightTileTopic> heights_;
  dds::Writer<dds::OctreeMapTopic> octree_;
  std::uint32_t crane_ = 0;
  Identity identity_;
  bool paper_method_ = false;
  std::unordered_map<TileKey, Published, TileKeyHash> published_;
  BtWriter bt_;
  BucketDigests voxel_digests_, height_digests_;
  std::uint32_t voxel_tiles_ = 0, height_tiles_ = 0;
  std::uint64_t revision_ = 0, octree_revision_ = 0, published_tiles_ = 0;
  TileKey resume_at_{std::numeric_limits<std::int32_t>::min(), 0};  ///< where the budget ended
  bool behind_ = false;
  OwedTiles owed_;
  DropCounts counts_;
  std::vector<StageMs> stages_;
};

}  // namespace crane
