// SPDX-License-Identifier: Apache-2.0
#include "config/camera_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

using Source = CameraConfig::Source;

void check_source(YamlReader& y, const CameraConfig& c) {
  if (c.source == Source::kFolder && c.path.empty())
    y.problem("path", "must name the folder that has left/ and right/");
  if (c.source == Source::kV4l2 && c.path.empty())
    y.problem("path", "must name the camera's node, such as /dev/v4l/by-id/...");
  if (c.source == Source::kGenicam && c.path.empty())
    y.problem("path", "must name the camera: its address or id, as arv-tool-0.8 shows them");
  if (c.source == Source::kGstreamer && c.pipeline.empty())
    y.problem("pipeline", "must be given: ... ! appsink");
  if (c.source == Source::kGstreamer && !c.path.empty())
    y.problem("path", "is not for source: gstreamer, whose pipeline names the camera");
  if (c.source == Source::kRecording && !c.path.empty())
    y.problem("path", "is of a live source; a recording is named on the command line");
  if (c.source != Source::kFolder && c.remove) y.problem("remove", "is for source: folder");
  if (c.source != Source::kGstreamer && !c.pipeline.empty())
    y.problem("pipeline", "is for source: gstreamer");
  if (c.source != Source::kGstreamer && c.for_viewing)
    y.problem("for_viewing", "is for source: gstreamer");
  if (c.source != Source::kGenicam && c.trigger != "off")
    y.problem("trigger", "is for source: genicam");
  if (c.source != Source::kGenicam && c.ptp) y.problem("ptp", "is for source: genicam");
}

void check_pair(YamlReader& y, const CameraConfig& c) {
  if (c.right.empty()) {
    if (c.pair_by != CameraConfig::PairBy::kTime || c.pair_within_ms > 0)
      y.problem(c.pair_within_ms > 0 ? "pair_within_ms" : "pair_by",
                "is of two cameras: right is missing");
    return;
  }
  if (c.source != Source::kV4l2 && c.source != Source::kGenicam)
    y.problem("right", "is for source: v4l2 or genicam");
  if (c.right == c.path) y.problem("right", "is the camera that path names");
  if (c.source == Source::kV4l2 && c.layout == CameraConfig::Layout::kY8i)
    y.problem("layout", "y8i is of one camera with two images");
  if (c.swap) y.problem("swap", "is of one camera: exchange path and right");
  if (c.brightness > 0)
    y.problem("brightness", "is of one camera: two must be set alike, by exposure_100us and gain");
  const double period_ms = 1000.0 / c.rate_hz;
  if (c.pair_by == CameraConfig::PairBy::kTime && c.pair_within_ms >= period_ms / 2)
    y.problem("pair_within_ms", "must be less than half the time between two pictures");
  if (c.pair_within_ms >= period_ms)
    y.problem("pair_within_ms", "must be less than the time between two pictures");
}

void check(YamlReader& y, const CameraConfig& c) {
  if (c.brightness > 0 && c.exposure_100us == 0)
    y.problem("brightness", "needs exposure_100us, the longest that motion allows");
  if (c.brightness > 0 && c.source != Source::kV4l2) y.problem("brightness", "is for source: v4l2");
  check_source(y, c);
  check_pair(y, c);
}

}  // namespace

void keys(KeyVisitor& v, CameraConfig& c) {
  v.choice({"source", "where pairs come from; a recording is named on the command line"}, c.source,
           {"recording", "folder", "v4l2", "genicam", "gstreamer"});
  v.text({"path",
          "folder: has left/ and right/, where images appear; v4l2: the camera's node, such as "
          "/dev/v4l/by-id/...; genicam: its address or id"},
         c.path);
  v.integer({"latency_ms", "subtracted from the camera's times"}, c.latency_ms, {-1000, 1000});
  v.flag({"remove", "folder: files are deleted once read"}, c.remove);
  v.choice({"layout", "v4l2: of a frame; both images side by side, of y8i interleaved"}, c.layout,
           {"yuyv", "grey", "y8i", "jpeg"});
  v.flag({"swap", "of one camera: the right image comes first"}, c.swap);
  v.integer(Key("width", "of a live camera: of each image").in("px"), c.width, {16, 8192});
  v.integer(Key("height", "of a live camera: of each image").in("px"), c.height, {16, 8192});
  v.integer({"rate_hz", "v4l2, genicam: frames a second"}, c.rate_hz, {1, 240});
  v.integer(
      {"exposure_100us", "v4l2, genicam: the exposure, or the longest; 0: the camera decides"},
      c.exposure_100us, {0, 100'000});
  v.integer({"gain", "v4l2, genicam: as the camera counts it; -1: as it is"}, c.gain,
            {-1, 100'000});
  v.integer({"brightness",
             "v4l2: mean grey level that is kept by exposure, up to exposure_100us, and gain; 0: "
             "not"},
            c.brightness, {0, 200});
  v.text({"right", "v4l2, genicam: the right one of two cameras, as path, which is the left one"},
         c.right);
  v.choice({"pair_by", "two cameras: what says that images are of one exposure"}, c.pair_by,
           {"time", "number"});
  v.number(Key("pair_within_ms", "two cameras: their times differ by no more")
               .by_default("0: a quarter of the period"),
           c.pair_within_ms, {0, 1000});
  v.text({"pixel_format", "genicam: as the camera names it"}, c.pixel_format);
  v.text({"trigger", "genicam: off, software, or the line that triggers, such as Line0"},
         c.trigger);
  v.choice({"stamps", "genicam: what says when a picture was taken"}, c.stamps,
           {"camera", "chunk", "arrival"});
  v.flag({"ptp", "genicam: keep the camera's clock in step by PTP"}, c.ptp);
  v.text({"pipeline", "gstreamer: as for gst-launch-1.0, ending in appsink"}, c.pipeline);
  v.flag({"for_viewing", "gstreamer: pictures without capture times are published, never mapped"},
         c.for_viewing);
  if (YamlReader* y = v.reading(); y != nullptr) check(*y, c);
}

}  // namespace crane
