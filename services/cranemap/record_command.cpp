// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "base/log.hpp"
#include "commands.hpp"
#include "progress.hpp"
#include "record_inputs.hpp"
#include "record_notes.hpp"
#include "record_units.hpp"
#include "recorder.hpp"
#include "recording/calibration.hpp"
#include "service/run_service.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// After the last frame positions are recorded for so long at most: they place it.
constexpr double kPositionsAfterMs = 1500;
constexpr double kNoFrameMs = 3'000, kTimesWrongMs = 10'000;

struct Options {
  SiteOptions site;
  std::string folder, calibration, out, lasts, ring, max_size = "20GB";
  int jpeg = 0;
  double wait_s = 10;
};

/// The options, understood.
struct Plan {
  SiteConfig site;
  StereoRig rig;
  SinkOptions sink;
  double lasts_s = 0;
};

Result<Plan> plan(const Options& o) {
  Plan p;
  SiteOptions site = o.site;
  if (site.config.empty() && !o.folder.empty()) site.config = o.folder + "/site.yaml";
  auto config = read_site(site);
  if (!config) return config.error();
  p.site = std::move(*config);
  const std::string& calibration = o.calibration.empty() ? o.folder : o.calibration;
  if (calibration.empty())
    return Error{ErrorCode::kConfiguration, "--calibration", "is needed",
                 "without it nobody could play the recording: the folder that camera, stereo and "
                 "mapper have, or --site DIR"};
  auto rig = read_rig(calibration);
  if (!rig) return rig.error();
  p.rig = *rig;
  p.sink.folder = o.out;
  if (o.jpeg > 0) {
    p.sink.format = "jpg";
    p.sink.jpeg_quality = o.jpeg;
  }
  if (!o.lasts.empty()) {
    auto seconds = parse_duration("--for", o.lasts);
    if (!seconds) return seconds.error();
    p.lasts_s = *seconds;
  }
  if (!o.ring.empty()) {
    auto seconds = parse_duration("--ring", o.ring);
    if (!seconds) return seconds.error();
    p.sink.ring = static_cast<TimeNs>(*seconds * 1e9);
  }
  auto size = parse_size("--max-size", o.max_size);
  if (!size) return size.error();
  p.sink.max_bytes = *size;
  return p;
}

class RecordRun {
 public:
  RecordRun(const Options& options, Plan plan) : options_(options), plan_(std::move(plan)) {}

  Result<int> execute() {
    if (auto begun = begin(); !begun) return begun.error();
    auto good = record();
    if (good && frames() == 0) good = nothing();
    const RecordingSink& sink = recorder_->finish();
    notes_.frames = recorder_->state().frames;  // of a ring: what is left
    if (notes_.frames == 0) {
      remove_what_was_made();
      return good ? Error{ErrorCode::kNotAvailable, options_.out, "no frame was recorded", ""}
                  : good.error();
    }
    return end(sink, good);
  }

 private:
  Result<void> begin() {
    std::error_code failed;
    existed_ = fs::exists(plan_.sink.folder, failed);
    RangefinderModel model;
    model.range_m = std::min(10'000.0, plan_.site.mapper.rangefinder_max_m);
    auto participant =
        dds::Participant::create(to_settings(plan_.site, "recorder"), "cranemap-record");
    if (!participant) return participant.error();
    participant_ = *participant;
    auto inputs = RecordInputs::create(participant_, &wakeup_, plan_.rig);
    if (!inputs) return inputs.error();
    inputs_.emplace(std::move(*inputs));
    auto sink = RecordingSink::create(plan_.sink, plan_.rig, 10, model);
    if (!sink) return sink.error();
    if (const auto space = fs::space(options_.out, failed);
        !failed && space.available < Recorder::Limits{}.free_bytes) {
      remove_what_was_made();
      return Error{ErrorCode::kResource, options_.out,
                   "has only " + size_text(space.available) + " left on its disk",
                   "give --out a folder on a disk with more: others need it too"};
    }
    notes_.began = SystemClock().now();
    if (auto written = write_site_files(plan_.site, *sink); !written) return written;
    recorder_.emplace(std::move(*sink), plan_.sink.folder, Recorder::Limits{});
    log_info("records crane " + std::to_string(plan_.site.crane) + " into " + options_.out +
             "; Ctrl-C ends it");
    return {};
  }

  [[nodiscard]] std::uint64_t frames() const {
    const Recorder::State s = recorder_->state();
    return s.frames + s.frames_refused + s.waiting;
  }

  /// Until it is enough, or goes wrong.
  Result<void> record() {
    Progress progress("recording");
    Stopwatch since_first, since_heard, since_recorded;
    std::uint64_t heard = 0, recorded = 0;
    const Stopwatch watch;
    while (!stop_requested()) {
      if (auto taken = inputs_->take(*recorder_); !taken) return taken;
      const Recorder::State s = recorder_->state();
      if (s.frames == 0) since_first = {};
      if (inputs_->heard().frames != heard) since_heard = {};
      if (s.frames != recorded) since_recorded = {};
      heard = inputs_->heard().frames;
      recorded = s.frames;
      if (!s.ended.empty()) break;
      if (recorded == 0 && watch.ms() > options_.wait_s * 1000) break;
      if (plan_.lasts_s > 0 && since_first.ms() > plan_.lasts_s * 1000) break;
      if (recorded > 0 && since_heard.ms() < 1000 && since_recorded.ms() > kTimesWrongMs &&
          inputs_->dropped().of(Cause::kRecordOtherTime) > 0)
        return Error{ErrorCode::kBadData, "stereo_frame",
                     "the camera's times stand still or jumped by more than an hour",
                     "set the clock, then record anew: one recording is of one clock"};
      show(progress, s, since_first.ms() * 1e-3, since_heard.ms());
      wakeup_.wait_for(20ms);
    }
    // What places the last frame has not come yet.
    inputs_->end_frames();
    for (const Stopwatch after; !inputs_->positions_follow() && after.ms() < kPositionsAfterMs;) {
      if (auto taken = inputs_->take(*recorder_); !taken) return taken;
      wakeup_.wait_for(20ms);
    }
    progress.finish("the last of it is written");
    return {};
  }

  void show(Progress& progress, const Recorder::State& s, double seconds, double silent_ms) {
    std::uint64_t lost = s.frames_refused;
    inputs_->dropped().for_each([&lost](Cause cause, std::uint64_t n) {
      if (cause == Cause::kRecordTooSlow || cause == Cause::kFrameMissing ||
          cause == Cause::kFrameLost || cause == Cause::kFrameOverwritten)
        lost += n;
    });
    std::string detail = "s  " + std::to_string(s.frames) + " frames  " + size_text(s.bytes);
    if (lost > 0) detail += "  LOST " + std::to_string(lost);
    if (s.free_bytes > 0) detail += "  " + size_text(s.free_bytes) + " free";
    if (!s.trouble.empty()) detail += "  " + s.trouble;
    if (s.frames == 0)
      detail = "s  waits for frames and positions";
    else if (silent_ms > kNoFrameMs)
      detail += "  no frame for " + std::to_string(int(silent_ms / 1000)) + " s";
    progress.update(static_cast<std::size_t>(seconds), static_cast<std::size_t>(plan_.lasts_s),
                    detail);
  }

  Result<void> nothing() const {
    if (const Recorder::State s = recorder_->state(); !s.ended.empty())
      return Error{ErrorCode::kResource, options_.out, s.ended, ""};
    std::string missing = inputs_->missing();
    if (missing.empty())
      missing = inputs_->dropped().of(Cause::kRecordUnplaced) > 0
                    ? "frames come, but of times before those of the positions -> one clock for "
                      "all: 'cranemap doctor' compares them"
                    : "frames and positions come, none could be recorded";
    return Error{ErrorCode::kNotAvailable, "nothing to record",
                 "within " + std::to_string(int(options_.wait_s)) + " s: " + missing, ""};
  }

  /// The folder was empty, so all in it is ours.
  void remove_what_was_made() const {
    std::error_code ignored;
    fs::remove_all(options_.out, ignored);
    if (existed_) fs::create_directory(options_.out, ignored);
  }

  Result<int> end(const RecordingSink& sink, const Result<void>& good) {
    const Recorder::State s = recorder_->state();
    notes_.ended = SystemClock().now();
    notes_.crane = plan_.site.crane;
    notes_.dropped = inputs_->dropped();
    if (s.frames_refused > 0) notes_.dropped.set(Cause::kRecordNoRoom, s.frames_refused);
    notes_.bytes = s.bytes;
    notes_.why_ended = !good ? good.error().text() : !s.ended.empty() ? s.ended : "as asked";
    if (auto written = write_notes(notes_, sink); !written) log_warning(written.error().text());
    print(notes_, options_.out);
    if (!s.trouble.empty())
      return Error{ErrorCode::kResource, options_.out, s.trouble,
                   "what was written before is a complete recording"};
    if (!good) return good.error();
    if (!s.ended.empty() && !s.ended_well)
      return Error{ErrorCode::kResource, options_.out, s.ended,
                   "what was written before is a complete recording"};
    if (!s.ended.empty()) log_info(s.ended);
    return lost_frames(notes_.dropped) > 0 ? static_cast<int>(kExitDataLost)
                                           : static_cast<int>(kExitOk);
  }

  const Options& options_;
  Plan plan_;
  bool existed_ = false;
  Wakeup wakeup_;
  std::shared_ptr<dds::Participant> participant_;
  std::optional<RecordInputs> inputs_;
  std::optional<Recorder> recorder_;
  RecordNotes notes_;
};

int record(const Options& options) {
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  auto planned = plan(options);
  if (!planned) return fail(planned.error());
  const auto code = RecordRun(options, std::move(*planned)).execute();
  return code ? *code : fail(code.error());
}

}  // namespace

Command add_record_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  Options& o = *options;
  CLI::App* command = app.add_subcommand(
      "record",
      "Records a crane that runs: frames, positions and hoist as the live topics say them, with\n"
      "calibration and configuration, for 'cranemap run'. Holds nobody up: what disk or processor\n"
      "cannot keep up with is dropped, counted and said. Ctrl-C ends with a complete recording.\n"
      "Example: cranemap record --site DIR --out rec --for 60s\n"
      "         cranemap record --config site.yaml --calibration calib --out last --ring 10min\n"
      "A pair of 1280 x 720 in colour takes 2 to 4 MB and 0.1 to 0.2 s of a core as PNG, which 10 "
      "a\n"
      "second need two free cores for; 0.8 MB and 0.015 s with --jpeg 95, which costs no "
      "accuracy.\n"
      "Exit codes: 0 all recorded, 2 configuration, 3 disk, or nothing came, 4 frames were lost.");
  command->add_option("--out", o.out, "New folder of the recording; never one that has something")
      ->required();
  add_site_options(*command, o.site);
  command->add_option("--site", o.folder, "Folder with site.yaml and the calibration")
      ->check(CLI::ExistingDirectory);
  command->add_option("--calibration", o.calibration,
                      "Folder with cam0/sensor.yaml, cam1/sensor.yaml and rig.yaml, as the "
                      "services have it");
  command->add_option("--for", o.lasts, "60s, 10min, 2h; else until Ctrl-C");
  command->add_option("--ring", o.ring, "Keep only the last 10min, say, until Ctrl-C");
  command
      ->add_option("--max-size", o.max_size,
                   "Of all images: the recording ends there, a ring gives up its oldest")
      ->capture_default_str();
  command->add_option("--jpeg", o.jpeg, "Images as JPEG of this quality; else PNG, lossless")
      ->check(CLI::Range(1, 100));
  command->add_option("--wait", o.wait_s, "Seconds until the first frame has to be there")
      ->check(CLI::Range(0.1, 86'400.0))
      ->capture_default_str();
  return [options] { return record(*options); };
}

}  // namespace crane
