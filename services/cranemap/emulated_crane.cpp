// SPDX-License-Identifier: Apache-2.0
#include "emulated_crane.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "emulated_trajectory.hpp"
#include "live_scene.hpp"
#include "recording/calibration.hpp"
#include "recording/recording.hpp"
#include "service/run_service.hpp"
#include "sim/simulate.hpp"
#include "sim/truth_writer.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr int kStopMs = 5000;
constexpr double kTruthCellM = 0.01;

/// A new folder: what is left of another crane would be taken for this one's.
Result<fs::path> new_folder(const std::string& folder) {
  const Error taken{ErrorCode::kConfiguration, folder, "is not empty",
                    "give a new folder, or remove this one first; nothing was changed"};
  if (folder.empty()) return Error{ErrorCode::kConfiguration, "--out", "names no folder", ""};
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!failed && !fs::is_empty(folder, failed) && !failed) return taken;
  const fs::path path = failed ? fs::path() : fs::canonical(folder, failed);
  if (failed)
    return Error{ErrorCode::kResource, folder, "cannot be made: " + failed.message(),
                 "check permissions"};
  return path;
}

void connect_devices(const fs::path& folder, bool keep, SiteConfig& site) {
  site.camera = {};
  site.camera.source = CameraConfig::Source::kFolder;
  site.camera.path = folder / "pictures";
  site.camera.remove = !keep;
  site.rangefinders.clear();
  for (const auto axis : {RangefinderConfig::Axis::kCart, RangefinderConfig::Axis::kTrolley}) {
    RangefinderConfig device;
    device.axis = axis;
    device.device = axis == RangefinderConfig::Axis::kCart ? RangefinderConfig::Device::kDimetix
                                                           : RangefinderConfig::Device::kSickDl100;
    device.port = folder / axis_name(axis);
    site.rangefinders.push_back(device);
  }
}

/// What the camera can see on its way.
Result<void> write_scene_truth(const Scene& scene, const fs::path& folder, std::size_t pairs) {
  std::error_code failed;
  fs::create_directories(folder / "truth", failed);
  if (failed)
    return Error{ErrorCode::kResource, folder / "truth", "cannot be made: " + failed.message(), ""};
  std::vector<Eigen::Vector2d> seen_from;
  for (std::size_t n = 0; n < pairs; ++n)
    seen_from.push_back(gantry_at(scene.motion, double(n) / scene.motion.rate_hz));
  const double end_s = double(pairs) / scene.motion.rate_hz;
  Renderer renderer(scene);
  auto standing = obstacles_at(scene, end_s);
  standing.resize(scene.obstacles.size());
  renderer.show(standing);
  return write_truth(folder, scene, renderer, seen_from, end_s, kTruthCellM);
}

}  // namespace

Result<EmulatedCrane> EmulatedCrane::prepare(const EmulatedCraneOptions& options, SiteConfig base,
                                             bool with_truth) {
  EmulatedCrane crane;
  crane.options_ = options;
  const auto is_recording = is_folder(options.from);
  if (!is_recording) return is_recording.error();
  crane.is_scene_ = !*is_recording;
  std::optional<Scene> scene;
  StereoRig rig;
  if (crane.is_scene_) {
    auto read =
        read_live_scene(options.from, {options.speed_mps, options.rate_hz, !options.one_round});
    if (!read) return read.error();
    scene = std::move(*read);
    rig = told_rig(scene->camera.rig, scene->faults);
    if (auto usable = check_rig(rig, options.from); !usable) return usable.error();
    if (scene->hoist) {
      set_hoist(*scene, base);
      crane.with_hoist_ = scene;
    }
    if (options.one_round || (!scene->motion.times_s.empty() && scene->motion.repeat_s == 0))
      crane.pairs_ = static_cast<std::size_t>(
          std::ceil(scene->motion.duration_s * scene->motion.rate_hz - 1e-9));
  } else {
    const auto recording = Recording::open(options.from);
    if (!recording) return recording.error();
    rig = recording->rig();
    if (!recording->hoist().empty())
      log_warning(options.from + ": its hoist_state is not emulated; your controller tells it");
  }
  const auto folder = new_folder(options.folder);
  if (!folder) return folder.error();
  crane.options_.folder = *folder;
  const double rate_hz = scene ? scene->motion.rate_hz : 1;
  if (auto written = write_rig(rig, *folder, rate_hz); !written) return written.error();
  connect_devices(*folder, options.pictures_kept, base);
  crane.site_ = std::move(base);
  std::ofstream file(*folder / "site.yaml");
  file << "# The devices of an emulated crane; the rest is as everywhere.\n"
       << to_yaml(crane.site_);
  file.close();
  if (!file)
    return Error{ErrorCode::kResource, *folder / "site.yaml", "cannot be written",
                 "check permissions and free space"};
  if (with_truth && scene && crane.pairs_ > 0)
    if (auto written = write_scene_truth(*scene, *folder, crane.pairs_); !written)
      return written.error();
  return crane;
}

Result<void> EmulatedCrane::start(const std::string& name, std::vector<std::string> arguments) {
  std::error_code failed;
  arguments.insert(arguments.begin(), fs::read_symlink("/proc/self/exe", failed));
  const std::string log = fs::path(options_.folder) / (name + ".log");
  auto process = ChildProcess::start(arguments, log);
  if (!process) return process.error();
  parts_.push_back({name, std::move(*process)});
  return {};
}

Result<void> EmulatedCrane::start_rangefinders(TimeNs start_at) {
  const std::string site = fs::path(options_.folder) / "site.yaml";
  for (const RangefinderConfig& device : site_.rangefinders) {
    std::vector<std::string> arguments = {"emulate",
                                          "--config",
                                          site,
                                          "--axis",
                                          axis_name(device.axis),
                                          is_scene_ ? "--scene" : "--recording",
                                          options_.from,
                                          "--start-at",
                                          std::to_string(start_at)};
    if (is_scene_)
      arguments.insert(arguments.end(), {"--scene-speed", std::to_string(options_.speed_mps)});
    if (auto started = start("emulate-" + axis_name(device.axis), std::move(arguments)); !started)
      return started;
  }
  return {};
}

Result<void> EmulatedCrane::start_camera(TimeNs start_at) {
  if (with_hoist_) {
    auto made = EmulatedHoist::create(*with_hoist_, site_, start_at + kBeforeFirstImage);
    if (!made) return made.error();
    hoist_.emplace(std::move(*made));
  }
  std::vector<std::string> arguments = {"emulate-camera",  options_.from, "--out",
                                        site_.camera.path, "--start-at",  std::to_string(start_at)};
  if (is_scene_) {
    arguments.insert(arguments.end(), {"--drive", "--rate", std::to_string(options_.rate_hz),
                                       "--speed", std::to_string(options_.speed_mps)});
    if (options_.one_round) arguments.emplace_back("--one-round");
  }
  return start("emulate-camera", std::move(arguments));
}

Result<void> EmulatedCrane::watch() {
  if (hoist_)
    if (auto told = hoist_->tell(); !told) return told;
  for (Part& part : parts_) {
    const auto exit = part.process.poll();
    if (!exit || part.ended) continue;
    part.ended = true;
    const std::string log = fs::path(options_.folder) / (part.name + ".log");
    if (exit->by_signal || exit->code != 0)
      return Error{ErrorCode::kResource, part.name,
                   (exit->by_signal ? "was ended by signal " : "ended with exit code ") +
                       std::to_string(exit->code),
                   "its log: " + log};
    if (part.name == "emulate-camera") camera_ended_ = true;
  }
  return {};
}

void EmulatedCrane::stop() {
  for (Part& part : parts_)
    if (!part.ended) part.process.stop(kStopMs);
  parts_.clear();
}

}  // namespace crane
