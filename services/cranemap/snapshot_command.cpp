// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "base/log.hpp"
#include "bounds.h"
#include "commands.hpp"
#include "dds/endpoints.hpp"
#include "map_snapshot.hpp"
#include "recording/calibration.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kPositionMs = 1'500;

struct Options {
  SiteOptions site;
  std::string folder, calibration, out;
  double wait_s = 10;
  bool even_invalid = false;
};

/// Cart and trolley now, as the mapper makes map coordinates of them; nothing: not both are told.
std::optional<LiveOverlay::Point> crane_position(
    const std::shared_ptr<dds::Participant>& participant, const SiteConfig& site) {
  auto reader = dds::Reader<dds::RangefinderPositionTopic>::create(participant, nullptr);
  if (!reader) return std::nullopt;
  std::optional<double> cart, trolley;
  const MapperConfig& m = site.mapper;
  for (const Stopwatch watch; watch.ms() < kPositionMs && !(cart && trolley);) {
    while (const auto sample = reader->take()) {
      const v1::RangefinderPosition& p = **sample;
      if (p.device_status() != v1::STATUS_OK) continue;
      if (p.axis() == v1::AXIS_CART) cart = m.cart_offset_m + m.cart_direction * p.distance_m();
      if (p.axis() == v1::AXIS_TROLLEY)
        trolley = m.trolley_offset_m + m.trolley_direction * p.distance_m();
    }
    std::this_thread::sleep_for(10ms);
  }
  if (!cart || !trolley) return std::nullopt;
  return LiveOverlay::Point{*cart, *trolley};
}

/// A new or empty folder that can be written. Error: Configuration, Resource.
Result<void> take_folder(const std::string& out) {
  std::error_code failed;
  fs::create_directories(out, failed);
  const bool empty = !failed && fs::is_empty(out, failed);
  if (failed)
    return Error{ErrorCode::kResource, out, "cannot be made: " + failed.message(),
                 "check permissions"};
  if (empty) return {};
  return Error{ErrorCode::kConfiguration, out, "is not empty",
               "give a new folder, or remove this one first; nothing was changed"};
}

Result<void> refuse(const client::Status& s, const Options& o) {
  const std::string marked = "or --even-invalid, which marks it";
  if (!s.heard)
    return Error{ErrorCode::kNotAvailable, "map_status",
                 "no mapper was heard within " + std::to_string(int(o.wait_s)) + " s",
                 "does cranemap-mapper run, in this domain, for this crane, on this network? "
                 "'cranemap doctor' looks further"};
  if (s.last_frame_time_ns == 0)
    return Error{ErrorCode::kNotAvailable, "the map", "has no frame yet: " + s.reason, ""};
  if (o.even_invalid) return {};
  if (!s.complete)
    return Error{ErrorCode::kNotAvailable, "the map",
                 "is not complete here after " + std::to_string(int(o.wait_s)) + " s",
                 "a longer --wait, " + marked};
  if (!s.valid)
    return Error{ErrorCode::kNotAvailable, "the map", "is not valid: " + s.reason,
                 "'cranemap watch' shows it; " + marked};
  return {};
}

Result<void> take(const Options& o) {
  SiteOptions site_options = o.site;
  if (site_options.config.empty() && !o.folder.empty())
    site_options.config = o.folder + "/site.yaml";
  auto site = read_site(site_options);
  if (!site) return site.error();
  MapSnapshot snapshot;
  const std::string& calibration = o.calibration.empty() ? o.folder : o.calibration;
  if (!calibration.empty()) {
    auto rig = read_rig(calibration);
    if (!rig) return rig.error();
    snapshot.rig = *rig;
  }
  if (auto taken = take_folder(o.out); !taken) return taken;
  std::string why;
  const auto participant =
      dds::Participant::create(to_settings(*site, "recorder"), "cranemap-snapshot");
  if (!participant) return participant.error();
  const auto map = client::Map::join((*participant)->fast_dds(), map_options(*site), why);
  if (!map) return Error{ErrorCode::kResource, "DDS", why, ""};
  client::Status s = map->status();
  for (const Stopwatch watch;
       !(s.valid && s.complete) && watch.ms() < o.wait_s * 1000 && !stop_requested();) {
    std::this_thread::sleep_for(20ms);
    s = map->status();
  }
  if (auto good = refuse(s, o); !good) return good;
  snapshot.position = crane_position(*participant, *site);
  snapshot.taken = SystemClock().now();
  snapshot.crane = site->crane;
  snapshot.grid = map->heights();
  snapshot.zones = map->zones();
  if (!map->save_bt(o.out + "/map.bt", why))
    return Error{ErrorCode::kResource, o.out + "/map.bt", why, ""};
  // What was said while it was taken holds for it: never better than at the worst moment.
  const client::Status after = map->status();
  snapshot.status = after;
  snapshot.status.valid = s.valid && after.valid;
  snapshot.status.complete = s.complete;  // each frame makes it incomplete for a moment
  if (!s.valid) snapshot.status.reason = s.reason;
  return write_snapshot(snapshot, o.out);
}

}  // namespace

Command add_snapshot_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  Options& o = *options;
  CLI::App* command = app.add_subcommand(
      "snapshot",
      "Saves the live map as it is now: map.bt and map.ot (octovis), map.pcd and map.ply\n"
      "(CloudCompare, MeshLab), height_map.png (16 bit, mm), map_view.png and map_ages.png for\n"
      "people, with crane, camera's footprint and date in them, snapshot.yaml.\n"
      "A map that is invalid or not complete is refused.\n"
      "Example: cranemap snapshot --site DIR --out monday");
  command->add_option("--out", o.out, "New or empty folder")->required();
  add_site_options(*command, o.site);
  command->add_option("--site", o.folder, "Folder with site.yaml and the calibration")
      ->check(CLI::ExistingDirectory);
  command->add_option("--calibration", o.calibration,
                      "Folder of the camera's calibration, for its footprint");
  command->add_option("--wait", o.wait_s, "Seconds to wait for a valid and complete map")
      ->check(CLI::Range(0.0, 86'400.0))
      ->capture_default_str();
  command->add_flag("--even-invalid", o.even_invalid,
                    "Save one that is not valid or complete as well; pictures say so in red");
  return [options] {
    if (const auto done = take(*options); !done) {
      log_error(done.error().text());
      std::error_code ignored;
      fs::remove(options->out, ignored);  // where nothing was written
      return static_cast<int>(exit_code(done.error()));
    }
    std::printf("the map of now is in %s; look at %s/map_view.png\n", options->out.c_str(),
                options->out.c_str());
    return static_cast<int>(kExitOk);
  };
}

}  // namespace crane
