// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "sensors/camera/v4l2_io.hpp"

namespace crane {

/// Exposure and gain of Stereolabs' ZED cameras, which are no V4L2 controls but registers of each
/// sensor and of the image processor, behind the camera's UVC extension unit (unit 4, selector 2;
/// after the maker's zed-open-capture). Both eyes are set alike and read again: eyes that differ do
/// not match. Not tried on a camera.
class ZedControls {
 public:
  /// `fd` of the open node; `rate_hz` of its mode, which says how long a line takes.
  ZedControls(V4l2Io& io, int fd, std::string name, int rate_hz)
      : io_(io), fd_(fd), name_(std::move(name)), rate_hz_(rate_hz) {}

  /// By the card's name that the driver gives.
  static bool is_zed(const std::string& card) { return card.starts_with("ZED"); }
  /// The camera no longer sets exposure and gain itself.
  Result<void> set_manual();
  /// In 100 us. Error: Configuration beyond what the rate leaves time for.
  Result<void> set_exposure(int exposure_100us);
  /// 0 .. kMostGain, in equal steps through the four ranges that the sensor has.
  Result<void> set_gain(int gain);

  /// The longest exposure at this rate [100 us].
  [[nodiscard]] int longest_exposure() const;
  static constexpr int kMostGain = 100;

 private:
  enum class Space { kLeftSensor, kRightSensor, kSystem };
  Result<std::uint8_t> read(Space space, std::uint32_t address);
  Result<void> write(Space space, std::uint32_t address, std::uint8_t value);
  Result<void> write_both(std::uint32_t address, const std::array<std::uint8_t, 3>& values);
  /// Sends a command and, with `answer`, takes its answer into the same bytes.
  Result<void> command(std::vector<std::uint8_t>& bytes, bool answer);
  Result<std::size_t> length();
  [[nodiscard]] Error trouble(int error) const;

  V4l2Io& io_;
  int fd_;
  std::string name_;
  int rate_hz_;
  std::size_t length_ = 0;  ///< of a command: 64 on USB 2, 384 on USB 3
};

}  // namespace crane
