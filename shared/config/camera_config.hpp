// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane {

class KeyVisitor;

/// Section `camera`: where cranemap-camera gets its pairs from, unless its command line names a
/// recording.
struct CameraConfig {
  enum class Source { kRecording, kFolder, kV4l2, kGenicam, kGstreamer };
  Source source = Source::kRecording;
  std::string path;
  int latency_ms = 0;
  bool remove = false;
  // v4l2, genicam, gstreamer.
  enum class Layout { kYuyv, kGrey, kY8i, kJpeg };
  Layout layout = Layout::kYuyv;
  bool swap = false;
  int width = 1280, height = 720;
  int rate_hz = 15;
  int exposure_100us = 0;
  int gain = -1;
  int brightness = 0;
  // Two cameras (v4l2, genicam): `path` is the left one.
  std::string right;
  enum class PairBy { kTime, kNumber };
  PairBy pair_by = PairBy::kTime;
  double pair_within_ms = 0;
  // genicam.
  std::string pixel_format = "Mono8";
  std::string trigger = "off";
  enum class Stamps { kCamera, kChunk, kArrival };
  Stamps stamps = Stamps::kCamera;
  bool ptp = false;
  // gstreamer.
  std::string pipeline;
  bool for_viewing = false;
};
void keys(KeyVisitor& v, CameraConfig& c);

}  // namespace crane
