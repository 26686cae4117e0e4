// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>

#include "base/drop_counts.hpp"
#include "base/stage_times.hpp"
#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "service/stream_gate.hpp"

namespace crane {

/// What the mapper reads. Positions and hoist states always; clouds (74 MB/s), requests and
/// commands only while it serves: a standby leaves them to the mapper that does. One thread.
class MapperInputs {
 public:
  /// Reads nothing but positions and hoist states yet.
  static Result<MapperInputs> create(const std::shared_ptr<dds::Participant>& participant,
                                     Wakeup* wakeup);
  Result<void> begin_serving();
  void end_serving();

  /// Positions and hoist states that came, into the pipeline.
  void take_motion(MappingPipeline& pipeline);
  /// The next cloud, copied: its writer may reuse the sample while it waits for positions. How it
  /// was delivered goes into `stages`.
  std::optional<CloudSample> take_cloud(StageTimes& stages);
  /// The next of each; nothing when none waits, or while it does not serve.
  std::unique_ptr<dds::Received<v1::TileRequest>> take_request();
  std::unique_ptr<dds::Received<v1::ZoneCommand>> take_command();

  /// Whether a rangefinder was heard within the last second.
  [[nodiscard]] bool hears_rangefinders() const;
  [[nodiscard]] std::uint64_t clouds_received() const { return clouds_received_; }
  /// Stream of the last cloud; 0 = none came.
  [[nodiscard]] std::uint64_t stream() const { return stream_; }
  /// What was not handed on, by cause.
  [[nodiscard]] DropCounts counts() const;

 private:
  struct Serving {
    dds::Reader<dds::PartialCloudTopic> clouds;
    dds::Reader<dds::TileRequestTopic> requests;
    dds::Reader<dds::ZoneCommandTopic> commands;
  };
  MapperInputs(std::shared_ptr<dds::Participant> participant, Wakeup* wakeup,
               dds::Reader<dds::RangefinderPositionTopic> positions,
               dds::Reader<dds::HoistStateTopic> hoist)
      : participant_(std::move(participant)),
        wakeup_(wakeup),
        positions_(std::move(positions)),
        hoist_(std::move(hoist)) {}
  void take_positions(MappingPipeline& pipeline);
  void take_hoist(MappingPipeline& pipeline);

  std::shared_ptr<dds::Participant> participant_;
  Wakeup* wakeup_;
  dds::Reader<dds::RangefinderPositionTopic> positions_;
  dds::Reader<dds::HoistStateTopic> hoist_;
  std::optional<Serving> serving_;
  StreamGate cloud_gate_;
  std::array<StreamGate, 3> position_gates_;  ///< as Axis counts
  /// One controller tells where the hook is: what a second one says would prove space free. Silent
  /// for this long it is lost anyway, and another may be it.
  SourceGate<dds::ParticipantId> hoist_gate_{std::chrono::milliseconds(500)};
  std::chrono::steady_clock::time_point position_heard_{};
  std::uint64_t clouds_received_ = 0, stream_ = 0;
  DropCounts counts_;
};

}  // namespace crane
