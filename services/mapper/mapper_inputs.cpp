#include "mapper/mapper_inputs.hpp"

#include "bounds.h"
#include "service/status_reporter.hpp"

namespace crane {
namespace {

/// Memory of its own: the writer may reuse the sample while the cloud waits for positions.
CloudSample copy(const v1::PartialCloud& c) {
  CloudSample out;
  const std::size_t pixels = std::size_t(c.width()) * c.height();
  out.stream = c.stream();
  out.sequence_number = c.sequence_number();
  out.after = c.after();
  out.exposure_time = c.exposure_time_ns();
  out.sent_time = c.frame_sent_ns();
  out.depth_m.assign(c.depth().begin(), c.depth().begin() + pixels);
  out.confidence.assign(c.confidence().begin(), c.confidence().begin() + pixels);
  if (c.has_colour() == 1) out.colour.assign(c.colour().begin(), c.colour().begin() + 3 * pixels);
  for (int i = 0; i < 9; ++i)
    out.R_camera_rectified(i / 3, i % 3) = c.rotation()[static_cast<std::size_t>(i)];
  out.frame.width = c.width();
  out.frame.height = c.height();
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

void MapperInputs::take_motion(MapBuilder& builder) {
  take_positions(builder);
  take_hoist(builder);
}

void MapperInputs::take_positions(MapBuilder& builder) {
  while (const auto sample = positions_.take()) {
    const v1::RangefinderPosition& p = **sample;
    const Axis axis = p.axis() == v1::AXIS_CART ? Axis::kCart : Axis::kTrolley;
    position_heard_ = std::chrono::steady_clock::now();
    if (!position_gates_[axis == Axis::kCart ? 0 : 1].pass(p.stream()))
      builder.dropped.add("position of a second rangefinder on one axis");
    else if (p.device_status() == v1::STATUS_OK)
      builder.add_position(axis, p.stream(), p.time_ns(), p.distance_m());
    else
      builder.add_failed_position(axis);
  }
}

void MapperInputs::take_hoist(MapBuilder& builder) {
  while (const auto sample = hoist_.take()) {
    const v1::HoistState& h = **sample;
    if (h.status() == v1::STATUS_FAILED) {
      builder.add_failed_hoist();
      continue;
    }
    HoistReading r;
    r.time = h.time_ns();
    r.hook_height_m = h.hook_height_m();
    r.sling_m = h.sling_m();
    r.load_size_m = {h.load_size_x_m(), h.load_size_y_m(), h.load_size_z_m()};
    r.load_yaw_rad = h.load_yaw_rad();
    r.sway_m = {h.sway_x_m(), h.sway_y_m()};
    builder.add_hoist(r);
  }
}

bool MapperInputs::take_clouds(MapBuilder& builder, const std::function<bool()>& stopping) {
  bool accounted = false;
  while (serving_ && !stopping()) {
    const auto sample = serving_->clouds.take();
    if (!sample) break;
    ++clouds_received_;
    stream_ = (*sample)->stream();
    add_delivery_times(builder.stages, "stereo to mapper", *sample, serving_->clouds.counts());
    if (!cloud_gate_.pass(stream_)) {
      builder.dropped.add("cloud of a second camera");
      continue;
    }
    CloudSample cloud = copy(**sample);
    if (sample->intact())
      builder.add_cloud(std::move(cloud), MonotonicClock().now());
    else
      builder.dropped.add("cloud overwritten before it was read");
    while (builder.step(MonotonicClock().now())) accounted = true;
  }
  while (builder.step(MonotonicClock().now())) accounted = true;
  return accounted;
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

void MapperInputs::add_drops(DropCounts& dropped) const {
  add_reader_drops(dropped, "position", positions_.counts());
  add_reader_drops(dropped, "hoist_state", hoist_.counts());
  if (!serving_) return;
  add_reader_drops(dropped, "cloud", serving_->clouds.counts());
  add_reader_drops(dropped, "tile_request", serving_->requests.counts());
  add_reader_drops(dropped, "zone_command", serving_->commands.counts());
}

}  // namespace crane
