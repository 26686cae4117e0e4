// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sensors/camera/genicam_io.hpp"

namespace crane {

struct GenicamOptions {
  enum class Stamps {
    kCamera,   ///< of the picture's leader, by the camera's clock
    kChunk,    ///< ChunkTimestamp, for cameras whose leader says something else
    kArrival,  ///< when it arrived: late by readout and network
  };
  std::string camera;   ///< address or id
  bool single = false;  ///< one of two cameras; else left | right in one picture
  std::uint32_t width = 1280, height = 720;  ///< of each image [px]
  std::string pixel_format = "Mono8";
  double rate_hz = 15;
  /// "off": as its own clock says; "software": told by us, at multiples of 1/rate_hz of this host's
  /// clock, so that two cameras are told at once; else the line that triggers, "Line0".
  std::string trigger = "off";
  Stamps stamps = Stamps::kCamera;
  bool ptp = false;
  std::optional<double> exposure_us;
  std::optional<double> gain;
  bool swap = false;
  std::int64_t latency = 0;  ///< subtracted from every time [ns]
};

/// What the camera has of a clock, once it is set.
struct GenicamClock {
  const char* ptp_status = nullptr;  ///< the feature that says how PTP is; none: not used
  double ticks_per_second = 1e9;     ///< of ChunkTimestamp
};

/// Sets an open camera's mode, trigger, light and clock, each feature by whichever of its names the
/// camera has, and reads it again: cameras round and cut.
/// Error: Configuration for what it has not or does not take, with the key to change.
Result<GenicamClock> set_genicam(GenicamIo& io, const GenicamOptions& options);

}  // namespace crane
