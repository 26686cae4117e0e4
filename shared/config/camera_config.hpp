#pragma once

#include <string>

namespace crane {

class KeyVisitor;

/// Section `camera`: where cranemap-camera gets its pairs from, unless its command line names a
/// recording.
struct CameraConfig {
  enum class Source { kRecording, kFolder, kV4l2 };
  Source source = Source::kRecording;
  std::string path;
  int latency_ms = 0;
  bool remove = false;
  // v4l2: one node whose frames carry both images.
  enum class Layout { kYuyv, kGrey, kY8i, kJpeg };
  Layout layout = Layout::kYuyv;
  bool swap = false;
  int width = 1280, height = 720;
  int rate_hz = 15;
  int exposure_100us = 0;
  int gain = -1;
  int brightness = 0;
};
void keys(KeyVisitor& v, CameraConfig& c);

}  // namespace crane
