// SPDX-License-Identifier: Apache-2.0
// Every fault alone over ten seconds of driving: found, named, and nothing mapped by it afterwards.
// One rendering serves all: what is told of cameras and rangefinders is wrong, images are right.

#include <gtest/gtest.h>

#include "sim/simulate.hpp"
#include "temp_folder.hpp"
#include "watch_trial.hpp"

namespace crane::accuracy {
namespace {

class WatchdogFaults : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    const auto scene = read_scene(CRANEMAP_WATCHDOG_SCENES "/drive.yaml");
    ASSERT_TRUE(scene) << scene.error().text();
    SimulateOptions options;
    options.folder = *folder_ / "drive";
    const auto done = simulate(make_quick(*scene), options);
    ASSERT_TRUE(done) << done.error().text();
    recording_ = new Recording(*Recording::open(options.folder));
  }
  static void TearDownTestSuite() {
    delete recording_;
    delete folder_;
  }
  static WatchOutcome watched(const std::vector<std::string>& faults) {
    std::vector<Fault> parsed;
    for (const std::string& f : faults) parsed.push_back(*parse_fault(f));
    auto outcome = watch(*recording_, parsed);
    EXPECT_TRUE(outcome) << outcome.error().text();
    return outcome ? *outcome : WatchOutcome{};
  }
  static test::TempFolder* folder_;
  static Recording* recording_;
};
test::TempFolder* WatchdogFaults::folder_ = nullptr;
Recording* WatchdogFaults::recording_ = nullptr;

TEST_F(WatchdogFaults, ADriveWithoutAnyIsFine) {
  const WatchOutcome o = watched({});
  EXPECT_EQ(o.state, WatchState::kFine) << text_of(o.misfit);
  EXPECT_EQ(o.drifting_after, -1) << "never, not even for a frame";
  EXPECT_EQ(o.wrong_after, -1);
  EXPECT_EQ(o.used, o.frames);
}

TEST_F(WatchdogFaults, EachAloneIsNamedWithinTenSecondsOfDriving) {
  struct Case {
    const char* fault;
    Suspect named;
    std::size_t most_used;  ///< frames in the map, of fifty
  };
  // Sizes of the acceptance table, and others of either sign.
  for (const Case& c : {Case{"toe_in=0.05", Suspect::kToeIn, 50},
                        Case{"toe_in=-0.08", Suspect::kToeIn, 50},
                        Case{"roll=0.2", Suspect::kRoll, 3},
                        Case{"roll=-0.3", Suspect::kRoll, 3},
                        Case{"pitch=0.2", Suspect::kRowOffset, 3},
                        Case{"tilt=0.5", Suspect::kTilt, 20},
                        Case{"tilt=-1", Suspect::kTilt, 20},
                        Case{"height=0.0195", Suspect::kHeight, 20},
                        Case{"height=-0.05", Suspect::kHeight, 20},
                        Case{"baseline=0.0015", Suspect::kBaseline, 50},
                        Case{"direction=3", Suspect::kCartDirection, 10},
                        Case{"trolley_direction=4", Suspect::kTrolleyDirection, 30},
                        Case{"scale=0.01", Suspect::kCartScale, 30},
                        Case{"trolley_scale=-0.015", Suspect::kTrolleyScale, 40},
                        Case{"jump=0.1", Suspect::kCartJump, 26},
                        Case{"trolley_jump=-0.07", Suspect::kTrolleyJump, 26},
                        Case{"delay=50", Suspect::kCartDelay, 30},
                        Case{"trolley_delay=-60", Suspect::kTrolleyDelay, 40},
                        Case{"yaw=0.2", Suspect::kTurned, 50},
                        Case{"yaw=-0.4", Suspect::kTurned, 40}}) {
    SCOPED_TRACE(c.fault);
    const WatchOutcome o = watched({c.fault});
    EXPECT_EQ(o.state, WatchState::kWrong);
    EXPECT_EQ(o.misfit.suspect, c.named) << text_of(o.misfit);
    EXPECT_GE(o.wrong_after, 0);
    EXPECT_LE(o.used, c.most_used);
    std::printf("%-22s %-18s after %4.1f s, %zu of %zu frames used: %s\n", c.fault,
                name_of(o.misfit.suspect), o.wrong_after_s, o.used, o.frames,
                text_of(o.misfit).c_str());
  }
}

TEST(WatchdogVibration, ACameraThatSwaysAndShakesIsNoFault) {
  auto scene = read_scene(CRANEMAP_WATCHDOG_SCENES "/drive.yaml");
  ASSERT_TRUE(scene) << scene.error().text();
  scene->untold.sway_roll_deg = scene->untold.sway_pitch_deg = 0.1;
  scene->untold.vibration_deg = 0.02;
  scene->untold.vibration_m = 0.001;
  const test::TempFolder folder;
  SimulateOptions options;
  options.folder = folder / "shaking";
  ASSERT_TRUE(simulate(make_quick(*scene), options));
  const auto recording = Recording::open(options.folder);
  ASSERT_TRUE(recording) << recording.error().text();
  const auto o = watch(*recording, {});
  ASSERT_TRUE(o) << o.error().text();
  EXPECT_EQ(o->drifting_after, -1) << text_of(o->misfit);
  EXPECT_EQ(o->wrong_after, -1) << text_of(o->misfit);
  EXPECT_EQ(o->used, o->frames);
}

TEST(WatchdogSkew, ASkewBridgeIsPlacedByTwoRangefindersAndNamedWhereThereIsOne) {
  auto scene = read_scene(CRANEMAP_WATCHDOG_SCENES "/drive.yaml");
  ASSERT_TRUE(scene) << scene.error().text();
  scene->untold.skew_deg = 0.5;
  scene->rangefinder.rail_y_m = -3;
  scene->rangefinder.rail_span_m = 10;
  scene->quick.frames = 36;
  const test::TempFolder folder;
  SimulateOptions options;
  options.folder = folder / "skew";
  ASSERT_TRUE(simulate(make_quick(*scene), options));
  const auto recording = Recording::open(options.folder);
  ASSERT_TRUE(recording) << recording.error().text();
  const auto two = watch(*recording, {});
  ASSERT_TRUE(two) << two.error().text();
  EXPECT_EQ(two->state, WatchState::kFine) << text_of(two->misfit);
  EXPECT_EQ(two->used, two->frames);
  const auto one = watch(*recording, {}, {}, false);
  ASSERT_TRUE(one) << one.error().text();
  EXPECT_EQ(one->state, WatchState::kWrong);
  EXPECT_EQ(one->misfit.suspect, Suspect::kTurned) << text_of(one->misfit);
}

}  // namespace
}  // namespace crane::accuracy
