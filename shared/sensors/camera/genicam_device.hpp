// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sensors/camera/device_clock.hpp"
#include "sensors/camera/genicam_io.hpp"
#include "sensors/camera/genicam_settings.hpp"
#include "sensors/camera/raw_picture.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// A GigE Vision or USB3 Vision camera, by whatever transport `io` has. Newest picture wins.
///
/// What is set is read again: cameras round and cut. Its stamps become epoch by DeviceClock; with
/// PTP in step they are epoch, taken as they are (TAI or UTC). Pictures that miss packets, of
/// another size or format are counted and refused.
class GenicamDevice final : public StereoDevice {
 public:
  GenicamDevice(GenicamOptions options, std::unique_ptr<GenicamIo> io,
                std::function<ClockPair()> clocks);
  ~GenicamDevice() override;

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::uint64_t missed() const override { return missed_; }
  [[nodiscard]] std::size_t image_bytes() const override;
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] std::string about() const override;

 private:
  std::optional<GenicamPicture> newest(FrameSource::Deadline deadline, DropCounts& dropped,
                                       Result<void>& triggered);
  bool use(const GenicamPicture& picture, const FrameBuffers& out, FrameFacts& facts,
           DropCounts& dropped);
  TimeNs time_of(const GenicamPicture& picture, FrameFacts& facts, DropCounts& dropped);
  void look_at_ptp();
  void count(std::uint64_t number);

  GenicamOptions options_;
  std::unique_ptr<GenicamIo> io_;
  std::function<ClockPair()> clocks_;
  bool open_ = false;
  std::optional<std::chrono::steady_clock::time_point> next_trigger_;
  DeviceClock clock_;
  TimeNs ahead_ = 0;     ///< of the epoch before the camera's clock [ns]
  GenicamClock source_;  ///< what the camera has of a clock
  std::string ptp_;      ///< what it said last
  bool by_ptp_ = false, by_arrival_ = false;
  std::uint64_t seen_ = 0;  ///< pictures since it opened
  std::optional<std::uint64_t> last_number_;
  std::uint64_t unwrapped_ = 0, missed_ = 0;
  bool given_ = false;  ///< the last picture that was grabbed
  std::string remark_;
};

}  // namespace crane
