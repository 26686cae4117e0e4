// SPDX-License-Identifier: Apache-2.0
// Sensors, images, calibration, zones: what is looked at while nothing of ours runs.
#include "commission_items.hpp"

#include <cstdio>
#include <filesystem>

#include "base/format.hpp"
#include "calibration/image_checks.hpp"
#include "camera_pairs.hpp"
#include "child_output.hpp"
#include "http/server.hpp"
#include "recording/calibration.hpp"
#include "recording/image_file.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr int kPairs = 4;
constexpr double kPatience_s = 10;
constexpr double kHighest_m = 100, kLongest_m = 5;

void take(CommissionItem& item, std::vector<Finding> findings) {
  item.findings.insert(item.findings.end(), findings.begin(), findings.end());
}

/// Where a calibration lies, put into the site.
Result<void> take_calibration(const std::string& from, const CommissionSite& site) {
  std::error_code failed;
  for (const char* part : {"cam0", "cam1", "rig.yaml"}) {
    fs::remove_all(fs::path(site.folder) / part, failed);
    fs::copy(fs::path(from) / part, fs::path(site.folder) / part,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing, failed);
    if (failed)
      return Error{ErrorCode::kResource, site.folder, "cannot be written: " + failed.message(),
                   "check permissions and free space"};
  }
  // What looks for site.yaml and for a folder of the calibration finds both, /etc/cranemap first.
  const fs::path link = fs::path(site.folder) / "calibration";
  fs::create_directory_symlink(".", link, failed);  // the second time it is there
  return {};
}

/// Before any service runs all their ports should be free: those of another crane are not ours.
void examine_ports(const HttpConfig& http, CommissionItem& item) {
  constexpr int kServices = 8, kApart = 20;
  for (int n = 1; http.port > 0 && n <= kServices; ++n)
    if (!http::Server::start(http.address, http.port + n, http::Router({}, {})))
      return item.bad(
          "ports", formatted("%d is taken, which is one of this crane's services", http.port + n),
          formatted("stop what runs of this crane; of another crane on this host: give "
                    "this one its own, http: {port: %d}",
                    http.port + kApart));
  item.good("HTTP ports", "those of the services are free");
}

}  // namespace

Result<void> commission_sensors(const CommissionSite& site, CommissionItem& item) {
  const auto config = read_site_config(site.site_yaml());
  if (!config) return config.error();
  take(item, examine_host(config.value()));
  examine_ports(config.value().http, item);
  if (config.value().rangefinders.empty())
    item.bad("rangefinders", "the configuration names none",
             "write a list 'rangefinders' with one for the bridge (axis: cart) and one for the "
             "trolley: docs/sensors.md");
  take(item, examine_rangefinders(config.value()));
  take(item, examine_camera(config.value()));
  if (config.value().camera.source == CameraConfig::Source::kRecording)
    item.bad("camera", "the configuration names none", "set camera.source: docs/sensors.md");
  return {};
}

Result<void> commission_images(const CommissionSite& site, CommissionItem& item) {
  const auto config = read_site_config(site.site_yaml());
  if (!config) return config.error();
  if (auto ready = site.answers->ready(
          "The cameras look at a floor with things or marks on it, in the light that the crane "
          "works by.");
      !ready)
    return ready;
  auto camera = CameraPairs::open(config.value());
  if (!camera) return camera.error();
  std::vector<CameraPairs::Pair> pairs;
  while (pairs.size() < kPairs) {
    auto pair = camera->next(kPatience_s);
    if (!pair) {
      item.bad("camera", pair.error().what, pair.error().todo);
      return {};
    }
    pairs.push_back(std::move(*pair));
  }
  std::vector<ImagePairView> views;
  for (const auto& pair : pairs) views.push_back({&pair.left, &pair.right});
  for (const ImageFinding& f : examine_images(views)) {
    if (f.bad)
      item.bad(f.what, f.text, f.advice);
    else
      item.good(f.what, f.text);
  }
  for (const bool right : {false, true}) {
    const std::string name = right ? "right.jpg" : "left.jpg";
    if (auto done =
            write_image(site.work() + "/" + name, right ? pairs.back().right : pairs.back().left);
        !done)
      return done;
    item.pictures.push_back({name, right ? "right image" : "left image"});
  }
  return {};
}

Result<void> commission_calibration(const CommissionSite& site, CommissionItem& item) {
  Answers& answers = *site.answers;
  const auto height = answers.number("camera_height_m", 0.3, kHighest_m);
  if (!height) return height.error();
  const auto baseline = answers.number("baseline_m", 0, kLongest_m);
  if (!baseline) return baseline.error();
  const auto board = answers.text("board");
  if (!board) return board.error();
  const auto images = answers.text("board_images");
  if (!images) return images.error();
  const std::string out = site.work() + "/calibration", kept = site.work() + "/board_images";
  const bool live = *images == "live";
  std::error_code failed;
  fs::remove_all(out, failed);
  std::vector<std::string> command = {
      "calibrate", "stereo", "--board",  *board,
      "--out",     out,      "--height", *answers.text("camera_height_m")};
  if (*baseline > 0) command.insert(command.end(), {"--baseline", *answers.text("baseline_m")});
  if (live)
    command.insert(command.end(), {"--live", site.site_yaml()});
  else
    command.push_back(*images);
  const auto said = run_cranemap(std::move(command), site.work() + "/calibration.log", live);
  if (fs::exists(out + "/images", failed)) {
    fs::remove_all(kept, failed);
    fs::rename(out + "/images", kept, failed);
    std::printf("  the images that were taken are in %s\n", kept.c_str());
  }
  if (!said) return said.error();
  const bool report = fs::exists(out + "/report.html", failed);
  if (said->code != 0) {
    // What it printed before says more than that it failed.
    for (const std::string& line : said->lines)
      if (line.starts_with("  - ")) item.warning("remark", line.substr(4), "see the report");
    item.bad("calibration", said->error.empty() ? "failed" : said->error,
             said->advice.empty() ? "see commission/calibration.log" : said->advice);
    for (const char* key : {"board", "board_images", "baseline_m"}) answers.forget(key);
  } else {
    for (const std::string& line : said->lines) {
      if (line.starts_with("GOOD") || line.starts_with("USABLE"))
        item.good("calibration", line);
      else if (line.starts_with("baseline"))
        item.good("cameras", line);
      else if (line.starts_with("  - "))
        item.warning("remark", line.substr(4), "may be left as it is");
    }
    if (auto taken = take_calibration(out, site); !taken) return taken;
  }
  if (report) item.pictures.push_back({"calibration/report.html", "report of the calibration"});
  return {};
}

Result<void> commission_zones(const CommissionSite& site, CommissionItem& item) {
  const auto config = read_site_config(site.site_yaml());
  if (!config) return config.error();
  for (const ZoneConfig& zone : config.value().zones) {
    std::string text = formatted("%d '%s', %s, %s, from %g to %g m:", zone.id, zone.name.c_str(),
                                 zone.slow_down ? "slow down" : "no go",
                                 zone.active ? "active" : "off", zone.z_min_m, zone.z_max_m);
    for (const auto& c : zone.corners) text += formatted(" (%g, %g)", c.x_m, c.y_m);
    std::printf("  zone %s\n", text.c_str());
    item.good("zone", text);
  }
  if (config.value().zones.empty()) item.good("zones", "the configuration has none");
  const auto right = site.answers->text("zones_right");
  if (!right) return right.error();
  if (*right != "yes") {
    item.bad("zones", "they are not as they should be",
             "correct 'zones' in site.yaml, or set them by 'cranemap zone'");
    site.answers->forget("zones_right");
  }
  return {};
}

}  // namespace crane
