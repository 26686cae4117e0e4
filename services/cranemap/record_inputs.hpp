// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <string>

#include "base/drop_counts.hpp"
#include "base/wakeup.hpp"
#include "dds/endpoints.hpp"
#include "recorder.hpp"
#include "service/stream_gate.hpp"

namespace crane {

/// What a recorder hears, as any subscriber would: frames, positions, hoist. It checks what would
/// make no recording, and counts it: second cameras, times that do not grow, another calibration.
class RecordInputs {
 public:
  static Result<RecordInputs> create(const std::shared_ptr<dds::Participant>& participant,
                                     Wakeup* wakeup, const StereoRig& rig);

  struct Heard {
    std::uint64_t frames = 0;
    std::array<std::uint64_t, 3> readings{};  ///< as Sensor counts
  };
  /// Hands on what has come. Error: Configuration, of frames that do not belong to this
  /// calibration.
  Result<void> take(Recorder& recorder);

  [[nodiscard]] const Heard& heard() const { return heard_; }
  /// Cart and trolley are heard, and frames.
  [[nodiscard]] bool all_heard() const;
  /// What is missing, each with what to check; for people.
  [[nodiscard]] std::string missing() const;
  /// Cart and trolley were measured later than the last frame that was recorded was exposed.
  [[nodiscard]] bool positions_follow() const;
  [[nodiscard]] const DropCounts& dropped() const { return dropped_; }
  /// From here on no frame is recorded; positions go on.
  void end_frames() { frames_end_ = true; }

 private:
  RecordInputs(dds::Reader<dds::StereoFrameTopic> frames,
               dds::Reader<dds::RangefinderPositionTopic> positions,
               dds::Reader<dds::HoistStateTopic> hoist, const StereoRig& rig);
  Result<void> take_frames(Recorder& recorder);
  void take_positions(Recorder& recorder);
  void take_hoist(Recorder& recorder);
  Result<void> check(const dds::StereoFrame& frame) const;
  void track(const dds::StereoFrame& frame);
  [[nodiscard]] bool placed(TimeNs time) const;

  dds::Reader<dds::StereoFrameTopic> frames_;
  dds::Reader<dds::RangefinderPositionTopic> positions_;
  dds::Reader<dds::HoistStateTopic> hoist_;
  StereoRig rig_;
  std::uint64_t calibration_;
  StreamGate camera_gate_;
  std::array<StreamGate, 3> position_gates_;
  SourceGate<dds::ParticipantId> hoist_gate_{std::chrono::milliseconds(500)};
  Heard heard_;
  DropCounts dropped_;
  TimeNs last_frame_ = 0, last_hoist_ = 0;
  std::array<TimeNs, 3> first_reading_{}, last_reading_{};  ///< recorded ones
  std::uint64_t stream_ = 0, sequence_ = 0;
  bool frames_end_ = false;
};

}  // namespace crane
