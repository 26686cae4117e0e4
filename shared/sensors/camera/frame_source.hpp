// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/clock.hpp"
#include "base/drop_counts.hpp"
#include "base/result.hpp"
#include "imaging/pixel_format.hpp"

namespace crane {

/// Where a source puts a pair: the two image buffers of one loaned sample, rows without padding.
struct FrameBuffers {
  std::uint8_t* left = nullptr;
  std::uint8_t* right = nullptr;  ///< none for one of two cameras (PairedDevice): it fills `left`
  std::size_t bytes = 0;          ///< of each
  std::size_t pixels = 0;         ///< the largest image
};

/// What is said of the pair that was put there.
struct FrameFacts {
  std::uint32_t width = 0, height = 0;  ///< of each image [px]
  PixelFormat format = PixelFormat::kMono8;
  /// Of JPEG: bytes of each image; of all others they follow from format and size.
  std::size_t left_bytes = 0, right_bytes = 0;
  TimeNs exposure_time = 0;   ///< middle of the exposure, Unix epoch
  std::uint64_t stream = 0;   ///< one uninterrupted numbering; another one at each connection
  std::int64_t sequence = 0;  ///< from 0; a gap is a loss
  std::int64_t after = -1;    ///< as StereoFrame.after: -1 but for what is sent again
  double decode_ms = 0, fill_ms = 0;
  std::uint64_t number = 0;  ///< as the device counts its frames or triggers
  double late_ms = 0;        ///< after the device's stamp, beyond the shortest way: its jitter
};

/// Where pairs of images come from: a recording, a folder, a camera. One thread, that of the
/// service, which does the same for every source: loan, next, publish.
class FrameSource {
 public:
  using Deadline = std::chrono::steady_clock::time_point;
  enum class Next {
    kFrame,    ///< a pair is in the buffers, and its facts are said
    kNothing,  ///< none yet: ask again; what was wrong with those that were none is counted
    kEnd,      ///< there will be no more
  };

  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Waits for the next pair, at most until `deadline`, and puts it into `out`.
  /// Error: what asking again does not mend: the configuration, or a map that never answers.
  virtual Result<Next> next(const FrameBuffers& out, FrameFacts& facts, Deadline deadline) = 0;

  /// Bytes of each image of the pairs that come, as far as known before they do, and no less than
  /// any pair that did not fit; 0: not known.
  [[nodiscard]] virtual std::size_t image_bytes() const { return 0; }
  /// What was lost or refused, by cause, since the start.
  [[nodiscard]] const DropCounts& dropped() const { return dropped_; }
  /// What is wrong now and what to do about it; empty: nothing.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// What it is connected to, and by which clock pairs are stamped; for the log.
  [[nodiscard]] virtual std::string about() const { return {}; }
  /// Pairs there were, used or not.
  [[nodiscard]] std::uint64_t received() const { return received_; }

 protected:
  DropCounts dropped_;
  std::string trouble_;
  std::uint64_t received_ = 0;
};

}  // namespace crane
