// SPDX-License-Identifier: Apache-2.0
#include "mapper/mapper_inputs.hpp"

#include <algorithm>

#include "bounds.h"
#include "dds/hoist_reading.hpp"
#include "service/status_reporter.hpp"

namespace crane {
namespace {

/// Memory of its own: the writer may reuse the sample while the cloud waits for positions.
CloudSample copy(const dds::PartialCloud& c) {
  CloudSample out;
  out.frame.width = c.width();
  out.frame.height = c.height();
  out.stream = c.stream();
  out.sequence_number = c.sequence_number();
  out.after = c.after();
  out.exposure_time = c.exposure_time_ns();
  out.sent_time = c.frame_sent_ns();
  out.depth_m.assign(c.depth().begin(), c.depth().end());
  out.confidence.assign(c.confidence().begin(), c.confidence().end());
  out.colour.assign(c.colour().begin(), c.colour().end());
  for (int i = 0; i < 9; ++i)
    out.R_camera_rectified(i / 3, i % 3) = c.rotation()[static_cast<std::size_t>(i)];
  out.calibration = c.calibration();
  out.rows = {c.row_patches(),        c.row_offset_px(), c.row_offset_sigma_px(), c.row_roll_rad(),
              c.row_roll_sigma_rad(), c.row_slope(),     c.row_slope_sigma()};
  out.frame.f_px = c.f_px();
  out.frame.cx_px = c.cx_px();
  out.frame.cy_px = c.cy_px();
  out.frame.baseline_m = c.baseline_m();
  out.frame.sigma_disparity_px = c.sigma_disparity_px();
  return out;
}

}  // namespace

Result<MapperInputs> MapperInputs::create(const std::shared_ptr<dds::Participant>& participant,
                                          Wakeup* wakeup) {
  auto positions = dds::Reader<dds::RangefinderPositionTopic>::create(participant, wakeup);
  if (!positions) return positions.error();
  auto hoist = dds::Reader<dds::HoistStateTopic>::create(participant, wakeup);
  if (!hoist) return hoist.error();
  return MapperInputs(participant, wakeup, std::move(*positions), std::move(*hoist));
}

Result<void> MapperInputs::begin_serving() {
  auto clouds = dds::Reader<dds::PartialCloudTopic>::create(participant_, wakeup_);
  if (!clouds) return clouds.error();
  auto requests = dds::Reader<dds::TileRequestTopic>::create(participant_, wakeup_);
  if (!requests) return requests.error();
  auto commands = dds::Reader<dds::ZoneCommandTopic>::create(participant_, wakeup_);
  if (!commands) return commands.error();
  serving_.emplace(Serving{std::move(*clouds), std::move(*requests), std::move(*commands)});
  return {};
}

void MapperInputs::end_serving() {
  serving_.reset();
}

void MapperInputs::take_motion(MappingPipeline& pipeline) {
  take_positions(pipeline);
  take_hoist(pipeline);
}

void MapperInputs::take_positions(MappingPipeline& pipeline) {
  while (const auto sample = positions_.take()) {
    const v1::RangefinderPosition& p = **sample;
    const Axis axis = p.axis() == v1::AXIS_CART      ? Axis::kCart
                      : p.axis() == v1::AXIS_TROLLEY ? Axis::kTrolley
                                                     : Axis::kCartSecond;
    position_heard_ = std::chrono::steady_clock::now();
    if (!position_gates_[static_cast<std::size_t>(axis)].pass(p.stream(), sample->writer(),
                                                              gone_from(positions_)))
      counts_.add(axis == Axis::kTrolley ? Cause::kTrolleySecondSource : Cause::kCartSecondSource);
    else if (p.device_status() == v1::STATUS_OK)
      pipeline.add_position(axis, p.stream(), p.time_ns(), p.distance_m());
    else
      pipeline.add_failed_position(axis);
  }
}

void MapperInputs::take_hoist(MappingPipeline& pipeline) {
  while (const auto sample = hoist_.take()) {
    const v1::HoistState& h = **sample;
    if (!hoist_gate_.pass(sample->writer())) {
      counts_.add(Cause::kHoistSecondSource);
      continue;
    }
    if (h.status() == v1::STATUS_FAILED) {
      pipeline.add_failed_hoist();
      continue;
    }
    pipeline.add_hoist(dds::hoist_reading(h));
  }
}

std::optional<CloudSample> MapperInputs::take_cloud(StageTimes& stages) {
  while (serving_) {
    const auto sample = serving_->clouds.take();
    if (!sample) break;
    ++clouds_received_;
    stream_ = (*sample)->stream();
    add_delivery_times(stages, "stereo to mapper", *sample, serving_->clouds.counts());
    if (!cloud_gate_.pass(stream_, sample->writer(), gone_from(serving_->clouds))) {
      counts_.add(Cause::kCloudSecondCamera);
      continue;
    }
    CloudSample cloud = copy(**sample);
    if (sample->intact()) return cloud;
    counts_.add(Cause::kCloudOverwritten);
  }
  return std::nullopt;
}

std::unique_ptr<dds::Received<v1::TileRequest>> MapperInputs::take_request() {
  return serving_ ? serving_->requests.take() : nullptr;
}

std::unique_ptr<dds::Received<v1::ZoneCommand>> MapperInputs::take_command() {
  return serving_ ? serving_->commands.take() : nullptr;
}

bool MapperInputs::hears_rangefinders() const {
  return std::chrono::steady_clock::now() - position_heard_ < std::chrono::seconds(1);
}

DropCounts MapperInputs::counts() const {
  DropCounts c = counts_;
  add_reader_drops(c, Cause::kPositionInvalid, Cause::kPositionLost, positions_.counts());
  add_reader_drops(c, Cause::kHoistInvalid, Cause::kHoistLost, hoist_.counts());
  if (!serving_) return c;
  add_reader_drops(c, Cause::kCloudInvalid, Cause::kCloudLost, serving_->clouds.counts());
  add_reader_drops(c, Cause::kTileRequestInvalid, Cause::kTileRequestLost,
                   serving_->requests.counts());
  add_reader_drops(c, Cause::kZoneCommandInvalid, Cause::kZoneCommandLost,
                   serving_->commands.counts());
  return c;
}

}  // namespace crane
