// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <string>
#include <vector>

#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"
#include "map_sync/early_tiles.hpp"
#include "map_sync/held_map.hpp"
#include "map_sync/resync.hpp"

namespace crane {

/// Follows a map as it is published: takes heartbeats, zones and tiles, and asks again for what is
/// missing. Believed is the process whose heartbeat DDS hands on, the strongest: tiles and zones of
/// any other are refused, so that nobody adds to a map of somebody else's. One thread steps it; any
/// number read under a shared lock of `mutex`.
class MapFollower {
 public:
  using Steady = std::chrono::steady_clock;
  /// So long may two processes both be there and say that they are the mapper: one that was killed
  /// is there for 5 s yet.
  static constexpr std::chrono::seconds kTwoMappers{10};

  /// `wakeup`: told of everything that arrives. `max_bytes`: of the tiles that are held. Error:
  /// what a reader or writer says.
  static Result<std::unique_ptr<MapFollower>> create(
      const std::shared_ptr<dds::Participant>& participant, Wakeup* wakeup, std::size_t max_bytes);

  /// Takes what arrived; the tiles that changed. Without memory for it the map is given up, said to
  /// be invalid, and begun anew after a while.
  std::vector<TileKey> step() noexcept;

  mutable std::shared_mutex mutex;

  // ------------------------------------------------ The caller holds the mutex, or is the stepper.

  [[nodiscard]] const HeldMap& held() const { return held_; }
  /// The mapper's, all of them, once they came; as they came.
  [[nodiscard]] const std::optional<v1::ZoneSet>& zones() const { return zones_; }
  [[nodiscard]] std::uint64_t zones_revision() const { return zones_ ? zones_->revision() : 0; }
  [[nodiscard]] double voxel_m() const { return voxel_m_; }
  /// The last heartbeat.
  [[nodiscard]] const std::optional<v1::MapStatus>& said() const { return said_; }
  [[nodiscard]] Steady::duration silence() const { return Steady::now() - said_at_; }
  /// Whether tiles, heights and zones are what the last heartbeat says.
  [[nodiscard]] bool complete() const;
  /// While the tiles of a new revision arrive, what is held is that of the last one.
  [[nodiscard]] bool lately_complete() const;
  /// Why what is held cannot be relied on, whatever the mapper says; empty: it can.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// The participant was deleted before this was: nothing arrives any more.
  [[nodiscard]] bool ended() const { return ended_; }
  /// How much later it is here than at the mapper [s], by its last heartbeat.
  [[nodiscard]] double clock_offset_s() const { return clock_offset_s_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }  ///< samples
  [[nodiscard]] std::uint64_t resyncs() const { return resyncs_; }

 private:
  MapFollower(std::shared_ptr<dds::Participant> participant, dds::Reader<dds::MapTileTopic> voxels,
              dds::Reader<dds::HeightTileTopic> heights, dds::Reader<dds::MapStatusTopic> statuses,
              dds::Reader<dds::ZoneSetTopic> zones, dds::Writer<dds::TileRequestTopic> requests,
              std::size_t max_bytes);

  template <class Sample>
  [[nodiscard]] bool ours(const Sample& sample) const {
    return sample.crane() == participant_->settings().crane;
  }
  std::vector<TileKey> take_all();
  void take_status(const dds::Received<v1::MapStatus>& received);
  void take_zones(const dds::Received<v1::ZoneSet>& received);
  void take_voxels(const dds::Received<v1::MapTile>& received);
  void take_heights(const dds::Received<v1::HeightTile>& received);
  void believe(const dds::ParticipantId& writer);
  void look_for_a_second_mapper();
  void put(const v1::MapTile& tile);
  void put(const v1::HeightTile& tile);
  void put(const v1::ZoneSet& set);
  void noted(Put put, TileKey key);
  void refuse(std::size_t samples = 1);
  void begin_anew(std::uint64_t map_id);
  void give_up(const char* why) noexcept;
  void resync();

  std::shared_ptr<dds::Participant> participant_;
  dds::Reader<dds::MapTileTopic> voxel_reader_;
  dds::Reader<dds::HeightTileTopic> height_reader_;
  dds::Reader<dds::MapStatusTopic> status_reader_;
  dds::Reader<dds::ZoneSetTopic> zone_reader_;
  dds::Writer<dds::TileRequestTopic> request_writer_;

  HeldMap held_;  ///< of the map that the mapper says it serves
  std::optional<v1::ZoneSet> zones_;
  std::optional<v1::MapStatus> said_;
  double voxel_m_ = 0, clock_offset_s_ = 0;
  Steady::time_point said_at_{}, complete_at_{};
  std::uint64_t refused_ = 0, resyncs_ = 0;
  std::string trouble_;
  bool ended_ = false;

  // Of the stepping thread only.
  dds::ParticipantId believed_{};  ///< who wrote the last heartbeat
  EarlyTiles<v1::MapTile> early_voxels_;
  EarlyTiles<v1::HeightTile> early_heights_;
  std::map<dds::ParticipantId, v1::ZoneSet> early_zones_;  ///< the last of each writer, of a few
  Resync resync_;
  bool two_mappers_ = false;
  std::uint64_t client_, request_number_ = 0;
  std::vector<TileKey> changed_;
};

}  // namespace crane
