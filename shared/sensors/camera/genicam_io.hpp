// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace crane {

/// One picture as it came, good or not.
struct GenicamPicture {
  enum class State { kWhole, kPacketsLost, kUnusable };
  State state = State::kWhole;
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;
  std::uint32_t width = 0, height = 0;
  std::uint32_t padding = 0;       ///< bytes behind each row
  std::uint32_t pixel_format = 0;  ///< its number by PFNC
  std::uint64_t number = 0;        ///< as the camera counts; of GigE Vision 16 bits, 0 left out
  TimeNs stamp = 0;                ///< of the leader, by the camera's clock
  TimeNs arrival = 0;              ///< when the leader came, Unix epoch
};

/// What a camera is used by that describes itself as GenICam says, so that a fake can answer as
/// real ones do. Features are named as the Standard Feature Naming Convention (SFNC) names them.
/// One thread.
class GenicamIo {
 public:
  struct Range {
    double least = 0, most = 0;
  };
  GenicamIo() = default;
  GenicamIo(const GenicamIo&) = delete;
  GenicamIo& operator=(const GenicamIo&) = delete;
  virtual ~GenicamIo() = default;

  /// `camera`: an address or the camera's id. Error: NotAvailable, Resource with what to do.
  virtual Result<void> open(const std::string& camera) = 0;
  virtual void close() = 0;
  /// Whether the feature is there and can be used now.
  virtual bool has(const char* feature) = 0;
  /// Integers and floats alike.
  virtual Result<double> number(const char* feature) = 0;
  virtual Result<Range> range(const char* feature) = 0;
  virtual Result<void> set_number(const char* feature, double value) = 0;
  /// Enumerations and strings.
  virtual Result<std::string> text(const char* feature) = 0;
  virtual Result<void> set_text(const char* feature, const std::string& value) = 0;
  virtual Result<void> set_flag(const char* feature, bool value) = 0;
  virtual Result<void> command(const char* feature) = 0;
  /// Pictures come from now on.
  virtual Result<void> start() = 0;
  /// The next picture in order; it stays until another one is given. Nothing: none within the time.
  virtual std::optional<GenicamPicture> next(std::chrono::microseconds timeout) = 0;
  /// A number out of the chunks of the last picture.
  virtual std::optional<std::int64_t> chunk(const char* feature) = 0;
  /// The camera does not answer any more, or another program has it.
  virtual bool lost() = 0;
};

}  // namespace crane
