// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <thread>

#include "base/clock.hpp"
#include "base/log.hpp"
#include "commands.hpp"
#include "emulated_trajectory.hpp"
#include "live_scene.hpp"
#include "recording/recording.hpp"
#include "service/exit_code.hpp"
#include "service/run_service.hpp"
#include "sim/renderer.hpp"
#include "sim/scene.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr int kRenderNice = 10;

struct Options {
  std::string from, out;
  TimeNs start_at = 0;
  double for_s = 0;
  LiveSceneOptions scene;
  bool drives = false;
};

/// What a camera would give, frame by frame: when, after the start, and both files' contents.
class Frames {
 public:
  virtual ~Frames() = default;
  /// When frame n is exposed [ns after the start]; nothing: there are no more.
  [[nodiscard]] virtual std::optional<TimeNs> due(std::int64_t n) const = 0;
  /// Puts both images of frame n at these paths, but for their extension, which it gives.
  virtual Result<std::string> put(std::int64_t n, const std::string& left,
                                  const std::string& right) = 0;
};

/// A recording's, round and round.
class Recorded final : public Frames {
 public:
  explicit Recorded(Recording recording) : recording_(std::move(recording)) {}
  std::optional<TimeNs> due(std::int64_t n) const override {
    return recording_.frame_time(n) - recording_.start();
  }
  Result<std::string> put(std::int64_t n, const std::string& left,
                          const std::string& right) override {
    const RecordedFrame& frame = recording_.frame(n);
    const std::string extension = fs::path(frame.left_file).extension();
    std::error_code failed;
    fs::copy_file(frame.left_file, left + extension, failed);
    if (!failed) fs::copy_file(frame.right_file, right + extension, failed);
    if (failed)
      return Error{ErrorCode::kResource, left, "cannot be written: " + failed.message(), ""};
    return extension;
  }

 private:
  Recording recording_;
};

/// A scene's, rendered as they are wanted.
class Rendered final : public Frames {
 public:
  explicit Rendered(Scene scene) : scene_(std::move(scene)), renderer_(scene_) {}
  std::optional<TimeNs> due(std::int64_t n) const override {
    const SceneMotion& m = scene_.motion;
    const double seconds = seconds_of(n);
    const bool over =
        m.continuous ? seconds >= m.duration_s : n >= static_cast<std::int64_t>(m.points.size());
    if (over) return std::nullopt;
    return kBeforeFirstImage + static_cast<TimeNs>(seconds * 1e9);
  }
  Result<std::string> put(std::int64_t n, const std::string& left,
                          const std::string& right) override {
    const double seconds = seconds_of(n);
    const Eigen::Vector2d at = gantry_at(scene_.motion, seconds);
    renderer_.show(obstacles_at(scene_, seconds));
    for (const bool is_left : {true, false}) {
      const Image image =
          renderer_.render(is_left, at.x(), at.y(), static_cast<std::uint64_t>(n), seconds);
      if (auto written = write_image((is_left ? left : right) + ".png", image); !written)
        return written.error();
    }
    return std::string(".png");
  }

 private:
  [[nodiscard]] double seconds_of(std::int64_t n) const {
    const SceneMotion& m = scene_.motion;
    return double(n) * (m.continuous ? 1 / m.rate_hz : m.interval_s);
  }
  Scene scene_;
  Renderer renderer_;
};

Result<std::unique_ptr<Frames>> open(const Options& o) {
  std::error_code ignored;
  if (fs::is_directory(o.from, ignored)) {
    auto recording = Recording::open(o.from);
    if (!recording) return recording.error();
    return std::unique_ptr<Frames>(std::make_unique<Recorded>(std::move(*recording)));
  }
  auto scene = o.drives ? read_live_scene(o.from, o.scene) : read_scene(scene_file(o.from));
  if (!scene) return scene.error();
  // What the simulator takes of the processor, no real camera would: services come first.
  if (setpriority(PRIO_PROCESS, 0, kRenderNice) != 0)
    log_warning("renders at the same priority as the services");
  return std::unique_ptr<Frames>(std::make_unique<Rendered>(std::move(*scene)));
}

Result<void> make_folders(const std::string& out) {
  for (const char* side : {"left", "right"}) {
    std::error_code failed;
    fs::create_directories(fs::path(out) / side, failed);
    if (failed)
      return Error{ErrorCode::kResource, out, "cannot be made: " + failed.message(),
                   "check permissions"};
  }
  return {};
}

Result<void> emulate(const Options& o) {
  auto frames = open(o);
  if (!frames) return frames.error();
  if (auto made = make_folders(o.out); !made) return made;
  const SystemClock clock;
  const TimeNs start = o.start_at > 0 ? o.start_at : clock.now();
  const TimeNs end = clock.now() + static_cast<TimeNs>(o.for_s * 1e9);
  std::uint64_t put = 0;
  std::uint64_t late = 0;
  for (std::int64_t n = 0; !stop_requested(); ++n) {
    const auto due = (*frames)->due(n);
    if (!due) break;
    // A camera waits for nobody: what is overdue by the next frame is not taken any more.
    const auto following = (*frames)->due(n + 1);
    if (following && start + *following <= clock.now()) {
      ++late;
      continue;
    }
    // Made before it is exposed, as its time is known: a camera does not take a second for a pair.
    const std::string name = std::to_string(start + *due);
    const std::string left = o.out + "/left/";
    const std::string right = o.out + "/right/";
    const auto extension = (*frames)->put(n, left + "." + name, right + "." + name);
    if (!extension) return extension.error();
    while (clock.now() < start + *due && !stop_requested())
      std::this_thread::sleep_for(std::chrono::nanoseconds(
          std::clamp<TimeNs>(start + *due - clock.now(), 0, kNsPerSecond / 20)));
    if (stop_requested() || (o.for_s > 0 && clock.now() >= end)) {
      std::error_code ignored;
      for (const std::string& side : {left, right})
        fs::remove(side + "." + name + *extension, ignored);
      break;
    }
    for (const std::string& side : {left, right}) {
      std::error_code failed;
      fs::rename(side + "." + name + *extension, side + name + *extension, failed);
      if (failed)
        return Error{ErrorCode::kResource, side + name,
                     "cannot be put in place: " + failed.message(), ""};
    }
    ++put;
  }
  log_info(std::to_string(put) + " pairs, " + std::to_string(late) +
           " left out because they came too late" +
           (late > put
                ? ": a scene is rendered more slowly than that -> a lower --rate, or a recording"
                : ""));
  return {};
}

}  // namespace

Command add_emulate_camera_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "emulate-camera",
      "Stands for a camera whose software writes files: pairs for camera.source: folder, in real\n"
      "time, out of a recording, round and round, or rendered out of a scene as they are due.\n"
      "Example: cranemap emulate-camera tests/data/rig --out /tmp/pictures");
  command->add_option("FROM", options->from, "Recording (folder), or scene (YAML file)")
      ->required();
  command->add_option("--out", options->out, "Gets left/ and right/; camera.path")->required();
  auto* drive = command->add_flag(
      "--drive", options->drives,
      "The scene's crane drives from point to point at constant speed, for ever, as with "
      "'cranemap emulate --scene'");
  command
      ->add_option("--rate", options->scene.rate_hz, "Pairs a second of a scene; 0 = the scene's")
      ->check(CLI::Range(0.0, 100.0))
      ->needs(drive);
  command->add_option("--speed", options->scene.speed_mps, "Of it [m/s]; 0 = the scene's")
      ->check(CLI::Range(0.0, 10.0))
      ->needs(drive);
  command
      ->add_flag("!--one-round", options->scene.without_end, "End when it has been at every point")
      ->needs(drive);
  command->add_option("--start-at", options->start_at,
                      "Wall time [ns] of the first instant, the same for emulated rangefinders; "
                      "0 = now");
  command->add_option("--for", options->for_s, "Seconds; 0 = to the end of a scene, or for ever")
      ->check(CLI::Range(0.0, 1e7));
  return [options] {
    const auto done = emulate(*options);
    if (done) return static_cast<int>(kExitOk);
    log_error(done.error().text());
    return static_cast<int>(exit_code(done.error()));
  };
}

}  // namespace crane
