// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// A device as a source that never ends: connects, and connects again when the device is lost, with
/// waits that double from 0.25 s to 8 s; each connection is a stream of its own, numbered from 0.
/// Times that go back by more than a second are those of a clock that was set: a new stream as
/// well; by less, the pair is refused.
class LiveSource final : public FrameSource {
 public:
  /// `clock`: steady, for waits. `sleep_until` sleeps to a time of that clock, or less.
  /// `draw_stream` gives stream numbers that nobody else has.
  LiveSource(std::unique_ptr<StereoDevice> device, const Clock& clock,
             std::function<void(TimeNs)> sleep_until, std::function<std::uint64_t()> draw_stream);
  ~LiveSource() override;

  Result<Next> next(const FrameBuffers& out, FrameFacts& facts, Deadline deadline) override;
  [[nodiscard]] std::size_t image_bytes() const override { return device_->image_bytes(); }

  [[nodiscard]] std::string about() const override { return device_->about(); }

  /// Connected without a pair for so long: said, and connected anew where that can help.
  static constexpr TimeNs kSilent = 5 * kNsPerSecond;

 private:
  Result<Next> connect();
  Result<Next> silent();
  Result<Next> lose(const Error& why);
  void begin_stream();

  std::unique_ptr<StereoDevice> device_;
  const Clock& clock_;
  std::function<void(TimeNs)> sleep_until_;
  std::function<std::uint64_t()> draw_stream_;
  bool connected_ = false;
  TimeNs retry_at_ = 0, wait_ = 0, heard_ = 0, last_time_ = 0;
  std::uint64_t stream_ = 0;
  std::int64_t sequence_ = 0;
};

}  // namespace crane
