#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <vector>

#include "base/wakeup.hpp"
#include "client/early_tiles.hpp"
#include "client/held_map.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"

namespace crane::client {

/// Follows a map as it is published: takes heartbeats, zones and tiles, and asks again for what is
/// missing. Believed is the process whose heartbeat DDS hands on, the strongest: tiles and zones of
/// any other are refused, so that nobody adds to a map of somebody else's. One thread steps it; any
/// number read under a shared lock of `mutex`.
class MapFollower {
 public:
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
  [[nodiscard]] double voxel_m() const { return voxel_m_; }
  /// The last heartbeat.
  [[nodiscard]] const std::optional<v1::MapStatus>& said() const { return said_; }
  [[nodiscard]] std::chrono::steady_clock::duration silence() const {
    return std::chrono::steady_clock::now() - said_at_;
  }
  [[nodiscard]] Status status() const;
  [[nodiscard]] bool complete() const;
  /// How much later it is here than at the mapper [s], by its last heartbeat.
  [[nodiscard]] double clock_offset_s() const { return clock_offset_s_; }
  /// While the tiles of a new revision arrive, what is held is that of the last one.
  [[nodiscard]] bool lately_complete() const;

 private:
  MapFollower(std::shared_ptr<dds::Participant> participant, dds::Reader<dds::MapTileTopic> voxels,
              dds::Reader<dds::HeightTileTopic> heights, dds::Reader<dds::MapStatusTopic> statuses,
              dds::Reader<dds::ZoneSetTopic> zones, dds::Writer<dds::TileRequestTopic> requests,
              std::size_t max_bytes);
  std::vector<TileKey> take_all();
  void give_up(const char* why) noexcept;
  [[nodiscard]] HeldMap nothing(std::uint64_t map_id) const {
    return HeldMap(map_id, held_.max_bytes());
  }
  void refuse(std::size_t samples = 1);
  template <class Sample>
  [[nodiscard]] bool ours(const Sample& sample) const {
    return sample.crane() == participant_->settings().crane;
  }
  void take_voxels(const dds::Received<v1::MapTile>& received);
  void take_heights(const dds::Received<v1::HeightTile>& received);
  void put(const v1::MapTile& tile);
  void put(const v1::HeightTile& tile);
  void noted(Put put, TileKey key);
  void take_zones(const dds::Received<v1::ZoneSet>& received);
  void take_status(const dds::Received<v1::MapStatus>& received);
  void believe(const dds::ParticipantId& writer);
  void resync();

  using Steady = std::chrono::steady_clock;
  std::shared_ptr<dds::Participant> participant_;
  dds::Reader<dds::MapTileTopic> voxel_reader_;
  dds::Reader<dds::HeightTileTopic> height_reader_;
  dds::Reader<dds::MapStatusTopic> status_reader_;
  dds::Reader<dds::ZoneSetTopic> zone_reader_;
  dds::Writer<dds::TileRequestTopic> request_writer_;

  HeldMap held_;         ///< of the map that the mapper says it serves
  std::string trouble_;  ///< why what is held cannot be the map, whatever the mapper says
  double voxel_m_ = 0, clock_offset_s_ = 0;
  std::uint64_t refused_ = 0, resyncs_ = 0;
  std::optional<v1::MapStatus> said_;
  Steady::time_point said_at_{}, complete_at_{};

  // Of the stepping thread only.
  dds::ParticipantId believed_{};  ///< who wrote the last heartbeat
  EarlyTiles<v1::MapTile> early_voxels_;
  EarlyTiles<v1::HeightTile> early_heights_;
  std::optional<v1::ZoneSet> early_zones_;
  dds::ParticipantId early_zones_writer_{};
  Steady::time_point tile_at_{}, asked_at_{}, rest_until_{};
  int asked_in_vain_ = 0, resyncs_in_vain_ = 0;
  std::uint64_t client_, request_number_ = 0;
  std::vector<TileKey> changed_;
};

}  // namespace crane::client
