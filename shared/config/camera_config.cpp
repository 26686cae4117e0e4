#include "config/camera_config.hpp"

#include <sstream>
#include <vector>

#include "config/yaml_reader.hpp"
#include "config/yaml_text.hpp"

namespace crane {
namespace {

using Source = CameraConfig::Source;

// As the enums of CameraConfig count.
const std::vector<std::string> kSources = {"recording", "folder", "v4l2", "genicam", "gstreamer"};
const std::vector<std::string> kLayouts = {"yuyv", "grey", "y8i", "jpeg"};
const std::vector<std::string> kPairBy = {"time", "number"};
const std::vector<std::string> kStamps = {"camera", "chunk", "arrival"};

template <class Choice>
void choose(YamlReader& y, const char* key, const std::vector<std::string>& names, Choice& value) {
  int index = static_cast<int>(value);
  y.choice(key, names, index);
  value = static_cast<Choice>(index);
}

template <class Choice>
const std::string& name_of(const std::vector<std::string>& names, Choice value) {
  return names[static_cast<std::size_t>(value)];
}

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

}  // namespace

void read_camera(YamlReader y, CameraConfig& c) {
  choose(y, "source", kSources, c.source);
  y.text("path", c.path);
  y.integer("latency_ms", c.latency_ms, -1000, 1000);
  y.flag("remove", c.remove);
  choose(y, "layout", kLayouts, c.layout);
  y.flag("swap", c.swap);
  y.integer("width", c.width, 16, 8192);
  y.integer("height", c.height, 16, 8192);
  y.integer("rate_hz", c.rate_hz, 1, 240);
  y.integer("exposure_100us", c.exposure_100us, 0, 100'000);
  y.integer("gain", c.gain, -1, 100'000);
  y.integer("brightness", c.brightness, 0, 200);
  if (c.brightness > 0 && c.exposure_100us == 0)
    y.problem("brightness", "needs exposure_100us, the longest that motion allows");
  if (c.brightness > 0 && c.source != Source::kV4l2) y.problem("brightness", "is for source: v4l2");
  y.text("right", c.right);
  choose(y, "pair_by", kPairBy, c.pair_by);
  y.number("pair_within_ms", c.pair_within_ms, 0, 1000);
  y.text("pixel_format", c.pixel_format);
  y.text("trigger", c.trigger);
  choose(y, "stamps", kStamps, c.stamps);
  y.flag("ptp", c.ptp);
  y.text("pipeline", c.pipeline);
  y.flag("for_viewing", c.for_viewing);
  check_source(y, c);
  check_pair(y, c);
}

std::string to_yaml(const CameraConfig& c) {
  const auto flag = [](bool value) { return value ? "true" : "false"; };
  std::ostringstream s;
  s << "camera:\n"
    << "  source: " << name_of(kSources, c.source) << "\n"
    << "  path: " << yaml_quoted(c.path) << "\n"
    << "  latency_ms: " << c.latency_ms << "\n"
    << "  remove: " << flag(c.remove) << "\n"
    << "  layout: " << name_of(kLayouts, c.layout) << "\n"
    << "  swap: " << flag(c.swap) << "\n"
    << "  width: " << c.width << "\n"
    << "  height: " << c.height << "\n"
    << "  rate_hz: " << c.rate_hz << "\n"
    << "  exposure_100us: " << c.exposure_100us << "\n"
    << "  gain: " << c.gain << "\n"
    << "  brightness: " << c.brightness << "\n"
    << "  right: " << yaml_quoted(c.right) << "\n"
    << "  pair_by: " << name_of(kPairBy, c.pair_by) << "\n"
    << "  pair_within_ms: " << yaml_exact(c.pair_within_ms) << "\n"
    << "  pixel_format: " << yaml_quoted(c.pixel_format) << "\n"
    << "  trigger: " << yaml_quoted(c.trigger) << "\n"
    << "  stamps: " << name_of(kStamps, c.stamps) << "\n"
    << "  ptp: " << flag(c.ptp) << "\n"
    << "  pipeline: " << yaml_quoted(c.pipeline) << "\n"
    << "  for_viewing: " << flag(c.for_viewing) << "\n";
  return s.str();
}

}  // namespace crane
