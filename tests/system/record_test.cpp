// SPDX-License-Identifier: Apache-2.0
// What the live topics say, recorded by an ordinary subscriber and played again.

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/clock.hpp"
#include "recording/recording.hpp"
#include "system/live_services.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

nlohmann::json mapped(const std::string& recording, const TempFolder& folder,
                      const std::string& name) {
  const Finished run = test::run({"run", recording, "--out", folder / name, "--voxel", "0.05",
                                  "--stamps", "recorded", "--domain", next_domain()},
                                 folder.path());
  EXPECT_EQ(run.code, 0) << run.output;
  std::ifstream file(folder / name + "/report.json");
  return nlohmann::json::parse(file);
}

class Record : public ::testing::Test {
 protected:
  Finished record(std::vector<std::string> more, double limit_s = 60) {
    more.insert(more.begin(), {"record", "--domain", domain_, "--calibration", rig_recording()});
    return run(more, folder_.path(), limit_s);
  }
  TempFolder folder_;
  std::string domain_ = next_domain();
};

TEST_F(Record, APlayedRecordingThatIsRecordedLiveGivesTheVerySameMap) {
  const std::string out = folder_ / "recorded";
  Process recorder({"cranemap", "record", "--domain", domain_, "--calibration", rig_recording(),
                    "--out", out, "--wait", "60"},
                   folder_ / "record.txt");
  ASSERT_TRUE(eventually(20s, [&] {
    return recorder.output().find("Ctrl-C ends it") != std::string::npos;
  })) << recorder.output();
  std::ofstream(folder_ / "site.yaml") << "dds: {domain: " << domain_ << "}\nhttp: {port: 0}\n";
  // A reader as the camera expects it, and players that begin once all have met.
  Process stereo(
      {"cranemap-stereo", "--config", folder_ / "site.yaml", "--calibration", rig_recording()},
      folder_ / "stereo.txt");
  const std::string start = std::to_string(SystemClock().now() + 5 * kNsPerSecond);
  std::list<Process> players;
  for (const char* player : {"cranemap-rangefinder", "cranemap-camera"})
    players.emplace_back(
        std::vector<std::string>{player, rig_recording(), "--config", folder_ / "site.yaml",
                                 "--start-at", start, "--stamps", "recorded"},
        folder_ / (std::string(player) + ".txt"));
  for (Process& player : players) EXPECT_EQ(player.wait(60), 0) << player.output();
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(30), 0) << recorder.output();
  const auto recording = Recording::open(out);
  ASSERT_TRUE(recording) << recording.error().text() << recorder.output();
  const auto original = Recording::open(rig_recording());
  ASSERT_TRUE(original);
  ASSERT_EQ(recording->frames().size(), original->frames().size()) << recorder.output();
  EXPECT_EQ(recording->cart().size(), original->cart().size());
  for (std::size_t i = 0; i < recording->cart().size(); ++i) {
    EXPECT_EQ(recording->cart()[i].time, original->cart()[i].time);
    EXPECT_EQ(recording->cart()[i].distance_m, original->cart()[i].distance_m);
  }
  EXPECT_TRUE(fs::exists(out + "/record.yaml"));
  EXPECT_TRUE(fs::exists(out + "/recorded_with.yaml"));
  const auto first = mapped(rig_recording(), folder_, "first");
  const auto again = mapped(out, folder_, "again");
  EXPECT_EQ(again["map"]["voxel_digest"], first["map"]["voxel_digest"]);
  EXPECT_EQ(again["map"]["height_digest"], first["map"]["height_digest"]);
}

TEST_F(Record, ForSomeSecondsOfALiveCraneAndNeverOverARecording) {
  const std::list<Process> services = live_services(folder_, domain_, "2");
  const std::string out = folder_ / "recorded";
  const Finished done = record({"--out", out, "--for", "4s", "--jpeg", "90", "--wait", "40"});
  EXPECT_EQ(done.code, 0) << done.output;
  const auto recording = Recording::open(out);
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_GE(recording->frames().size(), 3U);
  EXPECT_GT(recording->cart().back().time, recording->frames().back().time)
      << "what places the last frame";
  EXPECT_LE(recording->cart().front().time, recording->frames().front().time);
  EXPECT_EQ(fs::path(recording->frames()[0].left_file).extension(), ".jpg");
  const auto written = fs::last_write_time(out + "/cam0/data.csv");
  const Finished over = record({"--out", out, "--for", "1s"});
  EXPECT_EQ(over.code, 2);
  EXPECT_NE(over.output.find("nothing was changed"), std::string::npos) << over.output;
  EXPECT_EQ(fs::last_write_time(out + "/cam0/data.csv"), written);
}

TEST_F(Record, SaysWhichTopicIsMissingAndLeavesNothingBehind) {
  const std::string out = folder_ / "recorded";
  const Finished nothing = record({"--out", out, "--wait", "1"});
  EXPECT_EQ(nothing.code, 3) << nothing.output;
  EXPECT_NE(nothing.output.find("stereo_frame: nobody publishes it -> does cranemap-camera run"),
            std::string::npos)
      << nothing.output;
  EXPECT_NE(nothing.output.find("rangefinder_position of the cart"), std::string::npos);
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(Record, RefusesWhatItCannotUnderstandOrWrite) {
  const auto refused = [&](std::vector<std::string> more, int code, const std::string& needle) {
    const Finished said = record(std::move(more));
    EXPECT_EQ(said.code, code) << said.output;
    EXPECT_NE(said.output.find(needle), std::string::npos) << said.output;
  };
  const std::string out = folder_ / "recorded";
  refused({"--out", out, "--for", "soon"}, 2, "60s, 10min or 2h");
  refused({"--out", out, "--ring", "-3min"}, 2, "60s, 10min or 2h");
  refused({"--out", out, "--max-size", "20"}, 2, "500MB, 20GB or 1TB");
  refused({"--out", "/proc/recorded"}, 3, "/proc/recorded: cannot be written");
  const Finished uncalibrated = run({"record", "--out", out}, folder_.path());
  EXPECT_EQ(uncalibrated.code, 2);
  EXPECT_NE(uncalibrated.output.find("--calibration: is needed"), std::string::npos)
      << uncalibrated.output;
}

}  // namespace
}  // namespace crane::test
