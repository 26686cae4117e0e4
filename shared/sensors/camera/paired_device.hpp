// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sensors/camera/pair_matcher.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// Two cameras as one: each is asked by a thread of its own, and their images are brought together
/// by time or number. When one is lost both are closed, so that they begin anew together.
class PairedDevice final : public StereoDevice {
 public:
  /// Each gives one image (FrameBuffers without a right one), of at most `bytes` and `pixels`.
  PairedDevice(std::unique_ptr<StereoDevice> left, std::unique_ptr<StereoDevice> right,
               PairRule rule, std::size_t bytes, std::size_t pixels);
  ~PairedDevice() override;

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::uint64_t missed() const override { return missed_; }
  [[nodiscard]] std::size_t image_bytes() const override { return sides_[0].device->image_bytes(); }
  [[nodiscard]] std::string remark() const override;
  [[nodiscard]] std::string about() const override;

 private:
  struct Side {
    std::unique_ptr<StereoDevice> device;
    std::thread thread;
    // Under mutex_.
    std::uint64_t images = 0, missed = 0;  ///< since the last pair
    std::string remark, about;
    bool ended = false;  ///< its thread
  };
  void follow(int side);
  bool let_go();
  Result<bool> hand_over(const PairMatcher::Pair& pair, const FrameBuffers& out, FrameFacts& facts,
                         DropCounts& dropped);

  Side sides_[2];
  const PairRule rule_;
  const std::size_t bytes_, pixels_;
  mutable std::mutex mutex_;
  std::condition_variable came_;
  bool stop_ = false;  ///< of these, all under mutex_
  std::optional<Error> lost_;
  std::optional<PairMatcher> matcher_;
  DropCounts pending_;
  std::uint64_t missed_ = 0;  ///< before the pair that was grabbed last
  std::string remark_;
  std::optional<Error> last_;  ///< why the last connection ended
};

}  // namespace crane
