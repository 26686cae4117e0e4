// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sensors/camera/pipeline_io.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

struct PipelineOptions {
  std::string pipeline;
  std::uint32_t width = 1280, height = 720;  ///< of each image [px]; they come side by side
  bool swap = false;
  /// Pictures that nobody says the time of are given with that of their arrival. For people only: a
  /// map of them would be wrong by whatever network and decoder took.
  bool for_viewing = false;
  std::int64_t latency = 0;  ///< subtracted from every time [ns]
};

/// A stereo camera behind a media pipeline. Newest picture wins. Without the time of its exposure a
/// picture is counted and refused, unless it is for viewing.
class PipelineDevice final : public StereoDevice {
 public:
  PipelineDevice(PipelineOptions options, std::unique_ptr<PipelineIo> io);
  ~PipelineDevice() override;

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::uint64_t missed() const override { return missed_; }
  /// In colour or not only the first picture says.
  [[nodiscard]] std::size_t image_bytes() const override {
    return std::size_t{3} * options_.width * options_.height;
  }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] std::string about() const override;
  /// While pictures come their times may yet: RTSP's first sender report takes seconds.
  [[nodiscard]] bool reconnects_when_silent() const override { return !waits_for_times_; }

 private:
  bool use(const PipelinePicture& p, const FrameBuffers& out, FrameFacts& facts,
           DropCounts& dropped);
  void count(const PipelinePicture& p);

  PipelineOptions options_;
  std::unique_ptr<PipelineIo> io_;
  std::optional<std::uint64_t> last_number_;
  std::uint64_t missed_ = 0;
  bool given_ = false, waits_for_times_ = false;
  std::string clock_, remark_;
};

}  // namespace crane
