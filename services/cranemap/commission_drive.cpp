// SPDX-License-Identifier: Apache-2.0
// Drive, test map, hoist: what is looked at while services run.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <thread>

#include "base/format.hpp"
#include "child_output.hpp"
#include "child_process.hpp"
#include "commission_items.hpp"
#include "config/yaml_strict.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"
#include "recording/calibration.hpp"
#include "recording/recording.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kStopMs = 10'000;
constexpr double kShortest_m = 0.8;  ///< of a way that tells a direction and its scale
constexpr double kHoistSeconds = 5;

/// Services of the site while one item needs them.
Result<ChildProcess> serve(const CommissionSite& site, std::vector<std::string> services) {
  services.insert(services.begin(), {own_program(), "serve", "--site", site.folder});
  std::error_code ignored;
  const std::string log = site.work() + "/services.log";
  fs::remove(log, ignored);
  return ChildProcess::start(services, log);
}

double way(const std::vector<RecordedDistance>& readings) {
  const auto [low, high] =
      std::minmax_element(readings.begin(), readings.end(),
                          [](const auto& a, const auto& b) { return a.distance_m < b.distance_m; });
  return readings.empty() ? 0 : high->distance_m - low->distance_m;
}

/// One line that 'calibrate mount' printed: "  NAME   VALUE", "  - REMARK", or its verdict.
void take_mount_line(const std::string& line, CommissionItem& item) {
  if (line.starts_with("  - "))
    return item.warning("mount", line.substr(4), "see the report of the mount");
  if (line.starts_with("BAD")) return;  // said by its error, with what to do
  if (line.find(": the mount") != std::string::npos) return item.good("mount", line);
  const auto gap = line.find("  ", 2);
  if (!line.starts_with("  ") || gap == std::string::npos) return;
  const std::string name = line.substr(2, gap - 2);
  const std::string value = line.substr(std::min(line.size(), line.find_first_not_of(' ', gap)));
  constexpr std::string_view kNot = "not determined: ";
  if (value.starts_with(kNot))
    item.warning(name, "not determined", value.substr(kNot.size()));
  else
    item.good(name, value);
}

struct Object {
  double x_m = 0, y_m = 0, height_m = 0;
};
Result<Object> parse_object(const std::string& text) {
  Object out;
  std::size_t from = 0;
  for (double* number : {&out.x_m, &out.y_m, &out.height_m}) {
    const auto comma = text.find(',', from);
    std::string word = text.substr(std::min(from, text.size()), comma - from);
    word.erase(std::remove(word.begin(), word.end(), ' '), word.end());
    const auto value = decimal_number(word);
    const bool last = number == &out.height_m;
    if (!value || (comma == std::string::npos) != last)
      return Error{ErrorCode::kConfiguration, "object", "'" + text + "' is not X,Y,HEIGHT",
                   "three numbers in metres: 12.5,4.0,0.9"};
    *number = *value;
    from = comma + 1;
  }
  return out;
}

/// Until the object was seen by two frames, or it takes too long.
client::Height wait_for(const client::Map& map, const Object& object, double seconds) {
  client::Height h;
  for (const Stopwatch watch; watch.ms() < 1000 * seconds && !stop_requested();) {
    std::this_thread::sleep_for(200ms);
    h = map.height(object.x_m, object.y_m);
    if (client::is_known(h.surface) && h.views >= 2 && map.status().valid) break;
  }
  return h;
}

void judge(const client::Map& map, const Object& object, const client::Height& h, double camera_m,
           CommissionItem& item) {
  const client::Status s = map.status();
  if (!s.heard) return item.bad("map", "no mapper was heard", "see commission/services.log");
  if (!s.valid)
    return item.bad("map", "is not valid: " + s.reason,
                    "the watchdog compares what the camera sees with calibration and positions; "
                    "'cranemap watch' shows it");
  item.good("map", formatted("valid; %llu frames in it, %llu not used, voxel %g m",
                             static_cast<unsigned long long>(s.frames_integrated),
                             static_cast<unsigned long long>(s.frames_rejected + s.frames_missing),
                             s.voxel_m));
  const std::string place = formatted("(%g, %g)", object.x_m, object.y_m);
  if (!client::is_known(h.surface))
    return item.bad("known object", "nothing was mapped at " + place,
                    "drive over it slowly, or measure again where it stands");
  const double off = h.height_m - object.height_m;
  const double allowed = std::max(0.02 + 0.02 * object.height_m, 0.01 * camera_m);
  const std::string text =
      formatted("at %s %.3f m were mapped, %.3f are true: %+.1f cm of +-%.1f", place.c_str(),
                h.height_m, object.height_m, 100 * off, 100 * allowed);
  if (std::abs(off) <= allowed) return item.good("known object", text);
  item.bad("known object", text,
           "is the object where it was said to be? Else the drive or the calibration is wrong: do "
           "them again (--again drive)");
}

}  // namespace

Result<void> commission_drive(const CommissionSite& site, CommissionItem& item) {
  const auto seconds = site.answers->number("drive_s", 1, 3600);
  if (!seconds) return seconds.error();
  const auto start = site.answers->text("start");
  if (!start) return start.error();
  if (auto ready = site.answers->ready(
          formatted("Drive the bridge and the trolley, one after the other and to and fro, over a "
                    "floor with things on it, for %.0f seconds.",
                    *seconds));
      !ready)
    return ready;
  auto services = serve(site, {"camera", "rangefinder"});
  if (!services) return services.error();
  const std::string recording = site.work() + "/drive", out = site.work() + "/mount";
  std::error_code failed;
  fs::remove_all(recording, failed);
  fs::remove_all(out, failed);
  const auto recorded = run_cranemap({"record", "--site", site.folder, "--out", recording, "--for",
                                      *site.answers->text("drive_s") + "s"},
                                     site.work() + "/record.log", site.answers->interactive());
  services->stop(kStopMs);
  if (!recorded) return recorded.error();
  if (recorded->code != 0 && recorded->code != kExitDataLost) {
    item.bad("recording", recorded->error, recorded->advice);
    return {};
  }
  const auto drive = Recording::open(recording);
  if (!drive) return drive.error();
  const double bridge = way(drive.value().cart()), trolley = way(drive.value().trolley());
  const std::string ways = formatted("%zu frames; the bridge went %.2f m, the trolley %.2f m",
                                     drive.value().frames().size(), bridge, trolley);
  for (const auto& [name, metres] : {std::pair{"bridge", bridge}, std::pair{"trolley", trolley}})
    if (metres < kShortest_m)
      item.bad(
          "drive", ways,
          formatted("too short: drive the %s over %.1f m and more, to and fro", name, kShortest_m));
  if (item.any_bad()) return {};
  item.good("drive", ways);
  const auto mount =
      run_cranemap({"calibrate", "mount", recording, "--config", site.site_yaml(), "--out", out},
                   site.work() + "/mount.log", false);
  if (!mount) return mount.error();
  for (const std::string& line : mount->lines) take_mount_line(line, item);
  if (fs::exists(out + "/mount.html", failed))
    item.pictures.push_back({"mount/mount.html", "report of the mount's calibration"});
  if (mount->code != 0) {
    item.bad("mount", mount->error.empty() ? "failed" : mount->error,
             mount->advice.empty() ? "see commission/mount.log" : mount->advice);
    return {};
  }
  for (const char* file : {"rig.yaml", "site.yaml", "commissioning.yaml"}) {
    fs::copy_file(fs::path(out) / file, fs::path(site.folder) / file,
                  fs::copy_options::overwrite_existing, failed);
    if (failed)
      return Error{ErrorCode::kResource, site.folder + "/" + file,
                   "cannot be written: " + failed.message(), "check permissions and free space"};
  }
  return {};
}

Result<void> commission_map(const CommissionSite& site, CommissionItem& item) {
  const auto said = site.answers->text("object");
  if (!said) return said.error();
  const auto object = parse_object(*said);
  if (!object) {
    site.answers->forget("object");
    return object.error();
  }
  const auto patience = site.answers->number("object_wait_s", 1, 3600);
  if (!patience) return patience.error();
  const auto config = read_site_config(site.site_yaml());
  if (!config) return config.error();
  const auto rig = read_rig(site.folder);
  if (!rig) return rig.error();
  if (auto ready =
          site.answers->ready("Drive the crane slowly over the known object, from both sides.");
      !ready)
    return ready;
  auto services = serve(site, {});
  if (!services) return services.error();
  std::string why;
  const auto map = client::Map::join(client_options(config.value(), "dashboard"), why);
  if (!map) return Error{ErrorCode::kResource, "DDS", why, ""};
  const client::Height h = wait_for(*map, object.value(), *patience);
  judge(*map, object.value(), h, rig.value().camera_height_m(), item);
  const std::string out = site.work() + "/map";
  std::error_code failed;
  fs::remove_all(out, failed);
  const auto snapshot =
      run_cranemap({"snapshot", "--site", site.folder, "--out", out, "--even-invalid"},
                   site.work() + "/snapshot.log", false);
  services->stop(kStopMs);
  if (!snapshot) return snapshot.error();
  if (snapshot->code == 0)
    item.pictures.push_back({"map/map_view.png", "the map, from above"});
  else
    item.warning("picture", snapshot->error, snapshot->advice);
  return {};
}

Result<void> commission_hoist(const CommissionSite& site, CommissionItem& item) {
  const auto config = read_site_config(site.site_yaml());
  if (!config) return config.error();
  if (!config.value().hoist.enabled) {
    item.warning("hoist", "is not used: hook and load are mapped like everything else",
                 "let the controller publish hoist_state and set hoist.enabled: idl/README.md");
    return {};
  }
  const auto participant =
      dds::Participant::create(to_settings(config.value(), "recorder"), "cranemap-commission");
  if (!participant) return participant.error();
  auto reader = dds::Reader<dds::HoistStateTopic>::create(participant.value(), nullptr);
  if (!reader) return reader.error();
  std::size_t heard = 0;
  double low = 1e9, high = -1e9;
  for (const Stopwatch watch; watch.ms() < 1000 * kHoistSeconds && !stop_requested();) {
    while (const auto sample = reader->take()) {
      ++heard;
      low = std::min(low, (*sample)->hook_height_m());
      high = std::max(high, (*sample)->hook_height_m());
    }
    std::this_thread::sleep_for(20ms);
  }
  if (heard == 0)
    item.bad("hoist", formatted("no hoist_state was heard in %.0f s", kHoistSeconds),
             "does the controller publish it, in this domain, for this crane? 'cranemap doctor'");
  else
    item.good("hoist", formatted("%zu in %.0f s; the hook was at %.2f to %.2f m", heard,
                                 kHoistSeconds, low, high));
  return {};
}

}  // namespace crane
