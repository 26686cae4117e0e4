// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/camera/frame_source.hpp"

namespace crane {

/// One camera, or what stands for it, while it is connected. It knows nothing of streams and
/// numbers; whoever asks it from its one thread may block. One of two cameras is one as well: it is
/// given no right buffer, and fills the left one.
class StereoDevice {
 public:
  StereoDevice() = default;
  StereoDevice(const StereoDevice&) = delete;
  StereoDevice& operator=(const StereoDevice&) = delete;
  virtual ~StereoDevice() = default;

  /// Error: Configuration for what stays wrong until somebody changes it; else it is tried again.
  virtual Result<void> open() = 0;
  virtual void close() = 0;
  /// Waits for the newest pair, at most until `deadline`: true when it is in `out`, with size, time
  /// and durations in `facts`. Older pairs that waited are counted and left out.
  /// Error: the connection is of no more use: NotAvailable, Resource; or Configuration.
  virtual Result<bool> grab(const FrameBuffers& out, FrameFacts& facts,
                            FrameSource::Deadline deadline, DropCounts& dropped) = 0;
  /// Frames that the device numbered and never gave, between the last two grabbed pairs; not those
  /// that were left out here and counted.
  [[nodiscard]] virtual std::uint64_t missed() const { return 0; }
  /// As FrameSource::image_bytes().
  [[nodiscard]] virtual std::size_t image_bytes() const { return 0; }
  /// Whether connecting anew may wake it up.
  [[nodiscard]] virtual bool reconnects_when_silent() const { return true; }
  /// What deserves attention although pairs come; empty: nothing.
  [[nodiscard]] virtual std::string remark() const { return {}; }
  /// What it is and by which clock it stamps, once pairs come; for the log.
  [[nodiscard]] virtual std::string about() const { return {}; }
};

}  // namespace crane
