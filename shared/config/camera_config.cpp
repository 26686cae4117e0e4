#include "config/camera_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

using Source = CameraConfig::Source;

void check(YamlReader& y, const CameraConfig& c) {
  if (c.brightness > 0 && c.exposure_100us == 0)
    y.problem("brightness", "needs exposure_100us, the longest that motion allows");
  if (c.source == Source::kFolder && c.path.empty())
    y.problem("path", "must name the folder that has left/ and right/");
  if (c.source == Source::kV4l2 && c.path.empty())
    y.problem("path", "must name the camera's node, such as /dev/v4l/by-id/...");
  if (c.source == Source::kRecording && !c.path.empty())
    y.problem("path", "is of a live source; a recording is named on the command line");
  if (c.source != Source::kFolder && c.remove) y.problem("remove", "is for source: folder");
}

}  // namespace

void keys(KeyVisitor& v, CameraConfig& c) {
  v.choice({"source", "where pairs come from; a recording is named on the command line"}, c.source,
           {"recording", "folder", "v4l2"});
  v.text({"path",
          "folder: has left/ and right/, where images appear; v4l2: the camera's node, such as "
          "/dev/v4l/by-id/..."},
         c.path);
  v.integer({"latency_ms", "subtracted from the camera's times"}, c.latency_ms, {-1000, 1000});
  v.flag({"remove", "folder: files are deleted once read"}, c.remove);
  v.choice({"layout", "v4l2: of a frame; both images side by side, of y8i interleaved"}, c.layout,
           {"yuyv", "grey", "y8i", "jpeg"});
  v.flag({"swap", "v4l2: the right image comes first"}, c.swap);
  v.integer(Key("width", "v4l2: of each image").in("px"), c.width, {16, 8192});
  v.integer(Key("height", "v4l2: of each image").in("px"), c.height, {16, 8192});
  v.integer({"rate_hz", "v4l2: frames a second"}, c.rate_hz, {1, 240});
  v.integer({"exposure_100us", "v4l2: the exposure, or the longest; 0: the camera decides"},
            c.exposure_100us, {0, 100'000});
  v.integer({"gain", "v4l2: as the camera counts it; -1: as it is"}, c.gain, {-1, 100'000});
  v.integer({"brightness",
             "v4l2: mean grey level that is kept by exposure, up to exposure_100us, and gain; 0: "
             "not"},
            c.brightness, {0, 200});
  if (YamlReader* y = v.reading(); y != nullptr) check(*y, c);
}

}  // namespace crane
