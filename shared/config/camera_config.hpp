#pragma once

#include <string>

namespace crane {

/// Where cranemap-camera gets its pairs from, unless its command line names a recording.
struct CameraConfig {
  enum class Source { kRecording, kFolder, kV4l2, kGenicam, kGstreamer };
  Source source = Source::kRecording;  ///< source: recording | folder | v4l2 | genicam | gstreamer
  /// folder: has left/ and right/, where images appear; v4l2: /dev/video0, /dev/v4l/by-id/...;
  /// genicam: address or id.
  std::string path;
  int latency_ms = 0;   ///< subtracted from the camera's times
  bool remove = false;  ///< folder: files are deleted once read
  // v4l2, genicam, gstreamer.
  enum class Layout { kYuyv, kGrey, kY8i, kJpeg };
  Layout layout = Layout::kYuyv;   ///< v4l2: yuyv | grey | y8i | jpeg; all but y8i side by side
  bool swap = false;               ///< the right image comes first
  int width = 1280, height = 720;  ///< of each image [px]
  int rate_hz = 15;
  int exposure_100us = 0;  ///< 0 = the camera decides
  int gain = -1;           ///< as the camera counts it; -1 = as it is
  /// Mean grey level that is kept by exposure, up to exposure_100us, and gain; 0 = not. v4l2.
  int brightness = 0;
  // Two cameras (v4l2, genicam): `path` is the left one.
  std::string right;  ///< the right one, as `path`; empty = one camera gives both images
  enum class PairBy { kTime, kNumber };
  PairBy pair_by = PairBy::kTime;  ///< pair_by: time | number (of trigger or frame)
  double pair_within_ms = 0;       ///< their times differ by no more; 0 = a quarter of the period
  // genicam.
  std::string pixel_format = "Mono8";  ///< as the camera names it
  std::string trigger = "off";         ///< off | software | the line: Line0, Line1, ...
  enum class Stamps { kCamera, kChunk, kArrival };
  Stamps stamps = Stamps::kCamera;  ///< stamps: camera | chunk | arrival
  bool ptp = false;
  // gstreamer.
  std::string pipeline;      ///< as for gst-launch-1.0, ending in appsink
  bool for_viewing = false;  ///< pictures without capture times are published, never mapped
};

class YamlReader;
void read_camera(YamlReader y, CameraConfig& camera);
std::string to_yaml(const CameraConfig& camera);

}  // namespace crane
