// SPDX-License-Identifier: Apache-2.0
// What the watchdog makes of calibrations and rangefinders that are wrong.

#include <array>
#include <cstdio>

#include "experiments.hpp"
#include "sim/simulate.hpp"
#include "temp_folder.hpp"
#include "watch_trial.hpp"

namespace crane::accuracy {
namespace {

constexpr std::array kFaults = {"",
                                "toe_in=0.05",
                                "roll=0.2",
                                "tilt=0.5",
                                "height=0.0195",
                                "baseline=0.0015",
                                "direction=3",
                                "scale=0.01",
                                "trolley_scale=-0.01",
                                "jump=0.1",
                                "delay=50",
                                "yaw=0.2"};
static_assert(kFaults.size() == kWatchdogSteps);

std::string number(const char* form, double value) {
  char text[32];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

}  // namespace

Result<void> watchdog_faults(Bench& bench) {
  const auto scene = read_scene(CRANEMAP_SOURCE_DIR "/tests/accuracy/watchdog/drive.yaml");
  if (!scene) return scene.error();
  const test::TempFolder folder;
  SimulateOptions options;
  options.folder = folder / "drive";
  if (auto done = simulate(*scene, options); !done) return done;
  const auto recording = Recording::open(options.folder);
  if (!recording) return recording.error();
  constexpr std::array kStates = {"fine", "drifting", "wrong"};
  std::vector<Row> rows;
  for (const char* text : kFaults) {
    bench.step(std::string("watchdog: ") + (*text != 0 ? text : "no fault"));
    std::vector<Fault> faults;
    if (*text != 0) {
      auto fault = parse_fault(text);
      if (!fault) return fault.error();
      faults.push_back(*fault);
    }
    const auto o = watch(*recording, faults);
    if (!o) return o.error();
    rows.push_back({*text != 0 ? text : "none", kStates[static_cast<std::size_t>(o->state)],
                    name_of(o->misfit.suspect),
                    o->wrong_after < 0 ? "" : number("%.1f", o->wrong_after_s),
                    std::to_string(o->used) + "/" + std::to_string(o->frames),
                    number("%.2f", o->watch_ms), text_of(o->misfit)});
  }
  bench.document.section("Calibration and positions that are wrong");
  bench.document.text(
      "Ten seconds of driving at 0.5 m/s, five frames a second "
      "(tests/accuracy/watchdog/drive.yaml); what is told of "
      "cameras and rangefinders is wrong, the images are right. From \"wrong\" on no frame is used "
      "and the map is "
      "not valid.");
  bench.document.table(
      {"fault", "state", "named", "wrong after [s]", "frames used", "watch [ms]", "said"}, rows);
  return {};
}

}  // namespace crane::accuracy
