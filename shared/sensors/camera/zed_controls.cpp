// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/zed_controls.hpp"

#include <linux/usb/video.h>
#include <linux/uvcvideo.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

namespace crane {
namespace {

constexpr std::uint8_t kUnit = 4, kSelector = 2;
constexpr std::uint8_t kSet = 0x50, kGet = 0x51;
constexpr std::size_t kShortest = 64, kLongest = 384;
constexpr std::size_t kValue = 16, kAnswer = 17;  ///< where they stand in a command
constexpr int kTries = 3;
constexpr std::chrono::microseconds kPause{500};

constexpr std::uint32_t kExposure = 0x3500, kGain = 0x3507;          ///< high, middle, low byte
constexpr std::uint32_t kProcessor[2] = {0x8018'1033, 0x8018'1833};  ///< left, right
constexpr std::uint8_t kAutomatic = 0x02;
constexpr int kLeastLines = 2;

/// Lines that the exposure may last, of a frame's.
int most_lines(int rate_hz) {
  return rate_hz <= 15 ? 1550 : rate_hz <= 30 ? 1100 : rate_hz <= 60 ? 880 : 720;
}

struct Zone {
  int from, to;
};
/// What the sensor's gain register may hold.
constexpr Zone kZones[] = {{0, 255}, {378, 511}, {890, 1023}, {1914, 2047}};

int raw_gain(int gain) {
  int all = 0;
  for (const Zone& z : kZones) all += z.to - z.from + 1;
  int step = gain * (all - 1) / ZedControls::kMostGain;
  for (const Zone& z : kZones) {
    if (step <= z.to - z.from) return z.from + step;
    step -= z.to - z.from + 1;
  }
  return kZones[3].to;
}

std::vector<std::uint8_t> request(std::uint8_t task, bool system, bool right,
                                  std::uint32_t address) {
  std::vector<std::uint8_t> b(kShortest);
  b[0] = task;
  b[1] = system ? 0xA2 : right ? 0xA5 : 0xA3;
  b[2] = system ? 0x00 : 0x6C;
  b[3] = system ? 4 : 2;  // bytes of an address
  b[4] = 1;               // and of a value
  for (std::size_t i = 0; i < 4; ++i) b[5 + i] = static_cast<std::uint8_t>(address >> (24 - 8 * i));
  b[9] = system ? 0x00 : 0x90;
  b[10] = b[12] = 1;
  return b;
}

}  // namespace

Error ZedControls::trouble(int error) const {
  if (error == -ENODEV || error == -ENXIO)
    return {ErrorCode::kNotAvailable, name_, "no camera is there (any more)", "is it plugged in?"};
  if (error == -ENOENT || error == -ENOTTY || error == -EINVAL || error == -ENOBUFS)
    return {ErrorCode::kConfiguration, name_,
            "has not the ZED's registers of exposure and gain (" +
                std::string(std::strerror(-error)) + ")",
            "leave exposure_100us, gain and brightness of camera out"};
  return {ErrorCode::kResource, name_,
          "setting exposure or gain failed: " + std::string(std::strerror(-error)),
          "unplug the camera and plug it in again"};
}

Result<std::size_t> ZedControls::length() {
  if (length_ > 0) return length_;
  std::uint8_t size[2] = {0, 0};
  uvc_xu_control_query query{kUnit, kSelector, UVC_GET_LEN, sizeof size, size};
  if (const int e = io_.ioctl(fd_, UVCIOC_CTRL_QUERY, &query); e < 0) return trouble(e);
  const std::size_t said = std::size_t{size[1]} << 8U | size[0];
  if (said != kShortest && said != kLongest) return trouble(-ENOBUFS);
  return length_ = said;
}

Result<void> ZedControls::command(std::vector<std::uint8_t>& bytes, bool answer) {
  const auto size = length();
  if (!size) return size.error();
  bytes.resize(*size);
  int e = 0;
  for (int n = 0; n < kTries; ++n) {
    std::vector<std::uint8_t> sent = bytes;
    uvc_xu_control_query query{kUnit, kSelector, UVC_SET_CUR, static_cast<__u16>(sent.size()),
                               sent.data()};
    e = io_.ioctl(fd_, UVCIOC_CTRL_QUERY, &query);
    if (e == -ENODEV) break;
    std::this_thread::sleep_for(kPause);
    if (e < 0) continue;
    if (!answer) return {};
    query.query = UVC_GET_CUR;
    e = io_.ioctl(fd_, UVCIOC_CTRL_QUERY, &query);
    if (e < 0) continue;
    bytes = sent;
    return {};
  }
  return trouble(e);
}

Result<std::uint8_t> ZedControls::read(Space space, std::uint32_t address) {
  auto bytes = request(kGet, space == Space::kSystem, space == Space::kRightSensor, address);
  if (auto done = command(bytes, true); !done) return done.error();
  return bytes[kAnswer];
}

Result<void> ZedControls::write(Space space, std::uint32_t address, std::uint8_t value) {
  auto bytes = request(kSet, space == Space::kSystem, space == Space::kRightSensor, address);
  bytes[kValue] = value;
  return command(bytes, false);
}

Result<void> ZedControls::set_manual() {
  for (const std::uint32_t address : kProcessor) {
    const auto now = read(Space::kSystem, address);
    if (!now) return now.error();
    const auto wanted = static_cast<std::uint8_t>(*now & ~kAutomatic);
    if (auto done = write(Space::kSystem, address, wanted); !done) return done;
    const auto is = read(Space::kSystem, address);
    if (!is) return is.error();
    if ((*is & kAutomatic) != 0) return trouble(-EIO);
  }
  return {};
}

Result<void> ZedControls::write_both(std::uint32_t address,
                                     const std::array<std::uint8_t, 3>& values) {
  for (const Space eye : {Space::kLeftSensor, Space::kRightSensor})
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      if (auto done = write(eye, address + i, values[i]); !done) return done;
      const auto is = read(eye, address + i);
      if (!is) return is.error();
      if (*is != values[i])
        return Error{ErrorCode::kResource, name_,
                     std::string(eye == Space::kLeftSensor ? "the left" : "the right") +
                         " eye does not take exposure or gain",
                     "unplug the camera and plug it in again; its firmware may be too old"};
    }
  return {};
}

int ZedControls::longest_exposure() const {
  return 10'000 / rate_hz_;
}

Result<void> ZedControls::set_exposure(int exposure_100us) {
  if (exposure_100us < 0 || exposure_100us > longest_exposure())
    return Error{ErrorCode::kConfiguration, name_,
                 "exposure " + std::to_string(exposure_100us) + " is not within its 0 .. " +
                     std::to_string(longest_exposure()) + " at " + std::to_string(rate_hz_) + " Hz",
                 "change exposure_100us of camera"};
  // The most lines last as long as a frame.
  const int most = most_lines(rate_hz_);
  const auto lines = static_cast<int>(std::lround(double(exposure_100us) * 1e-4 * rate_hz_ * most));
  const int raw = std::clamp(lines, kLeastLines, most);
  return write_both(kExposure,
                    {static_cast<std::uint8_t>(raw >> 12), static_cast<std::uint8_t>(raw >> 4),
                     static_cast<std::uint8_t>(raw << 4 & 0xF0)});
}

Result<void> ZedControls::set_gain(int gain) {
  if (gain < 0 || gain > kMostGain)
    return Error{
        ErrorCode::kConfiguration, name_,
        "gain " + std::to_string(gain) + " is not within its 0 .. " + std::to_string(kMostGain),
        "change gain of camera"};
  const int raw = raw_gain(gain);
  return write_both(kGain, {static_cast<std::uint8_t>(raw >> 16),
                            static_cast<std::uint8_t>(raw >> 8), static_cast<std::uint8_t>(raw)});
}

}  // namespace crane
