#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <vector>

#include "base/wakeup.hpp"
#include "client/held_map.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"

namespace crane::client {

/// Follows a map as it is published: takes tiles, zones and heartbeats, and asks again for what is
/// missing. One thread steps it; any number read under a shared lock of `mutex`.
class MapFollower {
 public:
  /// `wakeup`: told of everything that arrives. Error: what a reader or writer says.
  static Result<std::unique_ptr<MapFollower>> create(
      const std::shared_ptr<dds::Participant>& participant, Wakeup* wakeup);

  /// Takes what arrived; the tiles that changed.
  std::vector<TileKey> step();

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
              dds::Reader<dds::ZoneSetTopic> zones, dds::Writer<dds::TileRequestTopic> requests);
  HeldMap& map_of(std::uint64_t map_id);
  void refuse();
  template <class Sample>
  [[nodiscard]] bool ours(const Sample& sample) const {
    return sample.crane() == participant_->settings().crane;
  }
  void take_voxels(const dds::Received<v1::MapTile>& received);
  void take_heights(const dds::Received<v1::HeightTile>& received);
  void take_zones(const v1::ZoneSet& set);
  void take_status(const v1::MapStatus& status);
  void arrived(TileKey key);
  void resync();

  using Steady = std::chrono::steady_clock;
  std::shared_ptr<dds::Participant> participant_;
  dds::Reader<dds::MapTileTopic> voxel_reader_;
  dds::Reader<dds::HeightTileTopic> height_reader_;
  dds::Reader<dds::MapStatusTopic> status_reader_;
  dds::Reader<dds::ZoneSetTopic> zone_reader_;
  dds::Writer<dds::TileRequestTopic> request_writer_;

  HeldMap held_;  ///< of the map that the mapper says it serves
  HeldMap next_;  ///< of another one, whose tiles came before the mapper said so
  double voxel_m_ = 0, clock_offset_s_ = 0;
  std::uint64_t refused_ = 0, resyncs_ = 0;
  std::optional<v1::MapStatus> said_;
  Steady::time_point said_at_{}, complete_at_{};

  // Of the stepping thread only.
  Steady::time_point tile_at_{}, asked_at_{};
  int asked_in_vain_ = 0;
  std::uint64_t client_, request_number_ = 0;
  std::vector<TileKey> changed_;
};

}  // namespace crane::client
