// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/pipeline_device.hpp"

#include <algorithm>
#include <utility>

namespace crane {
namespace {

constexpr const char* kName = "camera.pipeline";

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

PipelineDevice::PipelineDevice(PipelineOptions options, std::unique_ptr<PipelineIo> io)
    : options_(std::move(options)), io_(std::move(io)) {}

PipelineDevice::~PipelineDevice() {
  PipelineDevice::close();
}

Result<void> PipelineDevice::open() {
  close();
  return io_->open(options_.pipeline);
}

void PipelineDevice::close() {
  io_->close();
  last_number_.reset();
  missed_ = 0;
  given_ = waits_for_times_ = false;
  clock_.clear();
  remark_.clear();
}

/// What the source numbered and never gave.
void PipelineDevice::count(const PipelinePicture& p) {
  if (p.number && last_number_ && *p.number > *last_number_ + 1 &&
      *p.number - *last_number_ < 1'000'000)
    missed_ += *p.number - *last_number_ - 1;
  last_number_ = p.number;
}

/// False: counted and of no use.
bool PipelineDevice::use(const PipelinePicture& p, const FrameBuffers& out, FrameFacts& facts,
                         DropCounts& dropped) {
  const Stopwatch watch;
  const auto refuse = [&](Cause cause, const std::string& why) {
    dropped.add(cause);
    remark_ = std::string(kName) + ": " + why;
    return false;
  };
  waits_for_times_ = !p.captured && !options_.for_viewing;
  if (waits_for_times_)
    return refuse(Cause::kNoCaptureTime,
                  "does not say when pictures were taken, and no map can be made of them -> a live "
                  "source of this host, or RTSP with rtspsrc add-reference-timestamp-meta=true and "
                  "a camera that tells its clock; to look at them only: camera.for_viewing: true");
  if (p.picture.width != 2 * options_.width || p.picture.height != options_.height)
    return refuse(Cause::kFrameShort,
                  "gives " + size_text(p.picture.width, p.picture.height) +
                      " pixels, both images "
                      "side by side are " +
                      size_text(2 * options_.width, options_.height) +
                      " -> set camera.width and height, or scale in the pipeline");
  if (auto done = unpack(p.picture, options_.swap, kName, out, facts); !done)
    return refuse(Cause::kFrameShort, done.error().what);
  if (pair_swapped(out, facts))
    return refuse(Cause::kHalvesSwapped,
                  "left and right came the other way round -> if all frames do, set camera.swap");
  facts.exposure_time = p.captured.value_or(p.arrival) - options_.latency;
  facts.number = p.number.value_or(0);
  facts.decode_ms = watch.ms();
  clock_ = p.captured ? p.clock : "the time of arrival: for viewing only";
  return true;
}

Result<bool> PipelineDevice::grab(const FrameBuffers& out, FrameFacts& facts,
                                  FrameSource::Deadline deadline, DropCounts& dropped) {
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(
      deadline - std::chrono::steady_clock::now());
  if (std::exchange(given_, false)) missed_ = 0;
  auto next = io_->next(std::max(left, std::chrono::microseconds(0)));
  if (!next) return next.error();
  if (!*next) return false;
  PipelinePicture held = **next;
  for (;;) {
    count(held);
    auto newer = io_->next(std::chrono::microseconds(0));
    if (!newer) return newer.error();
    if (!*newer) break;
    dropped.add(Cause::kFrameOvertaken);
    held = **newer;
  }
  remark_.clear();
  given_ = use(held, out, facts, dropped);
  return given_;
}

std::string PipelineDevice::about() const {
  return clock_.empty() ? kName : std::string(kName) + ": stamped by " + clock_;
}

}  // namespace crane
