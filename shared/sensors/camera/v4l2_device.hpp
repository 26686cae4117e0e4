// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sensors/camera/brightness_control.hpp"
#include "sensors/camera/device_clock.hpp"
#include "sensors/camera/pair_layout.hpp"
#include "sensors/camera/stereo_device.hpp"
#include "sensors/camera/v4l2_io.hpp"
#include "sensors/camera/zed_controls.hpp"

namespace crane {

struct V4l2Options {
  std::string path = "/dev/video0";
  PairLayout layout = PairLayout::kSideBySideYuyv;
  bool single = false;  ///< one of two cameras: its pictures are one image (not with Y8I)
  std::uint32_t width = 1280, height = 720;  ///< of each image [px]
  int rate_hz = 15;
  bool swap = false;            ///< right | left
  std::int64_t latency = 0;     ///< subtracted from every time [ns]
  std::optional<int> exposure;  ///< V4L2_CID_EXPOSURE_ABSOLUTE [100 us]; unset: the camera's own
  std::optional<int> gain;      ///< V4L2_CID_GAIN
  /// Mean grey level to be kept by exposure, at most the one above, and gain; unset: nothing is
  /// kept.
  std::optional<double> brightness;
};

/// One UVC stereo camera: one V4L2 node whose frames carry both images. Newest frame wins.
///
/// Frames are stamped by the kernel on CLOCK_MONOTONIC and turned to the epoch one by one, by a
/// fresh pair of both clocks: no drift, and a clock that is set steps no frame before it is.
/// Frames that the driver marks bad, that are short, that end in repeated rows or whose halves are
/// the other way round are counted and refused.
class V4l2Device final : public StereoDevice {
 public:
  V4l2Device(V4l2Options options, std::unique_ptr<V4l2Io> io, std::function<ClockPair()> clocks);
  ~V4l2Device() override;

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::uint64_t missed() const override { return missed_; }
  [[nodiscard]] std::size_t image_bytes() const override {
    const bool may_have_colour = options_.layout == PairLayout::kSideBySideJpeg;
    return std::size_t{options_.width} * options_.height * (may_have_colour ? 3 : 1);
  }
  [[nodiscard]] std::string remark() const override { return remark_; }

 private:
  struct Buffer {
    std::uint8_t* memory = nullptr;
    std::size_t length = 0;
  };
  [[nodiscard]] Error trouble(int error, const std::string& doing) const;
  Result<void> check_camera();
  Result<void> set_mode();
  Result<void> set_controls();
  Result<v4l2_queryctrl> ask_control(std::uint32_t id, const char* name);
  Result<void> keep_brightness(const FrameBuffers& out, const FrameFacts& facts);
  Result<void> set_control(std::uint32_t id, const char* name, int value);
  Result<void> set_exposure(int value);
  Result<void> set_gain(int value);
  Result<void> set_zed();
  Result<void> start();
  Result<std::optional<v4l2_buffer>> newest(DropCounts& dropped);
  Result<void> give_back(v4l2_buffer buffer);
  bool use(const v4l2_buffer& buffer, const FrameBuffers& out, FrameFacts& facts,
           DropCounts& dropped);

  V4l2Options options_;
  std::unique_ptr<V4l2Io> io_;
  std::function<ClockPair()> clocks_;
  int fd_ = -1;
  bool streaming_ = false;
  std::size_t row_bytes_ = 0;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> last_sequence_;
  std::uint64_t missed_ = 0;        ///< before the pair that was grabbed last
  std::uint64_t left_out_ = 0;      ///< since then, and counted
  std::string card_;                ///< as the driver names it
  std::optional<ZedControls> zed_;  ///< of such a camera
  std::optional<BrightnessControl> control_;
  std::string remark_;
};

}  // namespace crane
