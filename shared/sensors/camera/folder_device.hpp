// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "geometry/stereo_rig.hpp"
#include "recording/image_file.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// The time a file is named after: 16 to 19 digits, nanoseconds since the Unix epoch. Else nothing.
std::optional<TimeNs> time_of_name(std::string_view stem);

struct FolderOptions {
  std::string path;              ///< has left/ and right/
  std::int64_t latency = 0;      ///< subtracted from every time [ns]
  bool remove = false;           ///< files are deleted once they are read, or passed over
  std::optional<StereoRig> rig;  ///< says what sizes are expected, and how many bits count
};

/// Pairs of image files that appear: left/NAME.png and right/NAME.png (or .jpg), in any order. For
/// cameras whose own software only writes files.
///
/// What is there when it opens is old. A pair is taken as soon as both files decode: renamed into
/// place or still being written, both are right. A file that does not decode and has not grown for
/// a second is unreadable; a single image waits as long for its other. The newest pair wins.
/// NAME is the exposure time in nanoseconds; else the time the left file was written stands for it,
/// and remark() says so. At most 20000 files a side: beyond that looking takes too long.
class FolderDevice final : public StereoDevice {
 public:
  /// `clock`: the system's, for what is of now. `steady`: for waits.
  FolderDevice(FolderOptions options, const Clock& clock, const Clock& steady);

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::size_t image_bytes() const override { return image_bytes_; }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] bool reconnects_when_silent() const override { return false; }

  static constexpr std::size_t kMostFiles = 20'000;
  static constexpr std::size_t kMostWaiting = 64;  ///< pairs that are not complete
  static constexpr TimeNs kPatience = kNsPerSecond;

 private:
  struct File {
    std::string path;  ///< empty: not there yet
    std::optional<Image> image;
    std::uint64_t tried_size = 0;  ///< at the last try to decode it
    TimeNs grew = 0;               ///< when that changed, steady
  };
  struct Pair {
    File side[2];
    TimeNs time = 0;   ///< of exposure; 0: not known before the left file is there
    TimeNs since = 0;  ///< when the first file was seen, steady
  };
  enum class State { kComplete, kWaiting, kRefused };

  Result<void> look(bool first);
  Result<State> judge(Pair& pair, const FrameBuffers& out, DropCounts& dropped);
  Result<State> decode(File& file, bool left, std::size_t pixels, DropCounts& dropped);
  void forget(std::map<std::string, Pair>::iterator pair);

  FolderOptions options_;
  const Clock& clock_;
  const Clock& steady_;
  std::set<std::string> seen_[2];        ///< names at the last look
  std::map<std::string, Pair> waiting_;  ///< by name without extension
  std::uint64_t too_many_ = 0;           ///< pairs given up because too many waited
  std::size_t image_bytes_ = 0;          ///< of the largest image that came
  std::string remark_;
};

}  // namespace crane
