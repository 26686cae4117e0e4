// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "dds/endpoints.hpp"
#include "sensors/camera/frame_source.hpp"

namespace crane {

/// Where pairs go: stereo_frame, whose memory is as large as the images of this camera. Before
/// their size is known they are put into memory of our own, and the first one is copied.
class FramePort {
 public:
  explicit FramePort(std::shared_ptr<dds::Participant> participant)
      : participant_(std::move(participant)) {}
  ~FramePort();
  FramePort(const FramePort&) = delete;
  FramePort& operator=(const FramePort&) = delete;

  /// Makes room for images of so many bytes; where there was less, readers have to find the topic's
  /// writer again. 0: nothing is known. Error: Resource.
  Result<void> grow_to(std::size_t image_bytes);
  /// To be filled next; nothing while readers hold all memory.
  std::optional<FrameBuffers> buffers();
  /// What was filled. Error: Resource.
  Result<void> publish(const FrameFacts& facts, std::uint64_t calibration);

  // As of dds::Writer.
  [[nodiscard]] int matched() const { return writer_ ? writer_->matched() : 0; }
  bool wait_for_readers(std::chrono::milliseconds limit) {
    return !writer_ || writer_->wait_for_readers(limit);
  }

 private:
  std::shared_ptr<dds::Participant> participant_;
  std::optional<dds::Writer<dds::StereoFrameTopic>> writer_;
  std::size_t capacity_ = 0;
  dds::StereoFrame* loan_ = nullptr;
  std::unique_ptr<dds::StereoFrame> own_;  ///< before there is a writer
};

}  // namespace crane
