// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "sensors/camera/raw_picture.hpp"

namespace crane {

/// One picture out of a media pipeline.
struct PipelinePicture {
  RawPicture picture;
  /// When it was taken, Unix epoch [ns]; nothing: the pipeline does not say.
  std::optional<TimeNs> captured;
  std::string clock;                    ///< what says so, for people
  TimeNs arrival = 0;                   ///< when it left the pipeline, Unix epoch
  std::optional<std::uint64_t> number;  ///< as its source counts
};

/// A media framework, behind an interface: its library is loaded only where it is used. One thread.
class PipelineIo {
 public:
  PipelineIo() = default;
  PipelineIo(const PipelineIo&) = delete;
  PipelineIo& operator=(const PipelineIo&) = delete;
  virtual ~PipelineIo() = default;

  /// Error: Configuration for a text that is no pipeline of ours; else what the pipeline says.
  virtual Result<void> open(const std::string& pipeline) = 0;
  virtual void close() = 0;
  /// The next picture in order; it stays until another is given. Error: the pipeline has failed or
  /// ended.
  virtual Result<std::optional<PipelinePicture>> next(std::chrono::microseconds timeout) = 0;
};

}  // namespace crane
