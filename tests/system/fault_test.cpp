// SPDX-License-Identifier: Apache-2.0
// kill -9 of any service during a run: the rest go on, it rejoins, the run ends well and leaves
// nothing behind.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "crane/client/map.hpp"
#include "process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

class KilledService : public ::testing::TestWithParam<const char*> {};

TEST_P(KilledService, IsStartedAgainAndNoFrameIsLost) {
  const TempFolder folder;
  const std::string lap = folder / "lap";
  ASSERT_EQ(run({"simulate", CRANEMAP_SOURCE_DIR "/shared/sim/scenes/lap.yaml", "--out", lap,
                 "--frames", "16"},
                folder.path(), 200)
                .code,
            0);
  const std::vector<std::string> before = shared_memory_files();
  const std::string program = std::string("cranemap-") + GetParam();
  const std::string domain = next_domain();
  Process cranemap(
      {"cranemap", "run", lap, "--out", folder / "out", "--voxel", "0.05", "--domain", domain},
      folder / "run.txt");
  // In the midst of it: some frames are in the map, others are not.
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  ASSERT_TRUE(eventually(60s, [&] { return map->status().frames_integrated >= 1; }))
      << cranemap.output();
  ASSERT_LT(map->status().frames_integrated, 16U) << "the play was over before it could be struck";
  map.reset();  // whose shared memory is not to be counted
  const pid_t victim = child_named(cranemap.pid(), program);
  ASSERT_GT(victim, 0) << cranemap.output();
  kill(victim, SIGKILL);
  ASSERT_EQ(cranemap.wait(100), 0) << cranemap.output();
  std::ifstream file(folder / "out/report.json");
  const auto report = nlohmann::json::parse(file);
  EXPECT_EQ(report["frames"]["integrated"], 16);
  EXPECT_EQ(report["services"][GetParam()]["restarts"], 1);
  EXPECT_TRUE(report["map"]["complete_at_subscriber"]);
  EXPECT_NE(cranemap.output().find(program + " was killed by signal 9"), std::string::npos);
  // What the killed process left was cleared when it was started again.
  for (const std::string& name : shared_memory_files())
    EXPECT_NE(std::find(before.begin(), before.end(), name), before.end()) << name << " was left";
}

INSTANTIATE_TEST_SUITE_P(Services, KilledService,
                         ::testing::Values("camera", "rangefinder", "stereo", "mapper"),
                         [](const auto& service) { return std::string(service.param); });

TEST(KilledAfterThePlay, AMapperThatFellBackGetsTheFramesAgain) {
  const TempFolder folder;
  Process cranemap({"cranemap", "run", rig_recording(), "--out", folder / "out", "--voxel", "0.05",
                    "--domain", next_domain()},
                   folder / "run.txt");
  const auto log_says = [&](const std::string& service, const std::string& text) {
    std::ifstream file(folder / ("out/logs/" + service + ".log"));
    const std::string all((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    return all.find(text) != std::string::npos;
  };
  ASSERT_TRUE(eventually(60s, [&] { return log_says("camera", "end of the recording"); }))
      << cranemap.output();
  const pid_t victim = child_named(cranemap.pid(), "cranemap-mapper");
  ASSERT_GT(victim, 0);
  kill(victim, SIGKILL);
  // The next one reads its map on disk after it has listened for a rival.
  ASSERT_TRUE(eventually(500ms, [&] {
    std::error_code failed;
    std::filesystem::remove_all(folder / "out/state", failed);
    return !failed;
  }));
  ASSERT_EQ(cranemap.wait(100), 0) << cranemap.output();
  EXPECT_TRUE(log_says("camera", "end of the recording: 6 frames"));
  EXPECT_NE(cranemap.output().find("they are played again"), std::string::npos);
  std::ifstream file(folder / "out/report.json");
  const auto report = nlohmann::json::parse(file);
  EXPECT_EQ(report["frames"]["integrated"], 6);
  EXPECT_TRUE(report["map"]["complete_at_subscriber"]);
}

TEST(KilledRun, TakesItsServicesWithIt) {
  const TempFolder folder;
  Process cranemap({"cranemap", "run", rig_recording(), "--out", folder / "out", "--rate", "real",
                    "--domain", next_domain()},
                   folder / "run.txt");
  pid_t mapper = 0;
  for (int i = 0; i < 500 && mapper == 0; ++i) {
    mapper = child_named(cranemap.pid(), "cranemap-mapper");
    std::this_thread::sleep_for(10ms);
  }
  ASSERT_GT(mapper, 0);
  cranemap.signal(SIGKILL);
  cranemap.wait(5);
  bool gone = false;
  for (int i = 0; i < 500 && !gone; ++i) {
    gone = kill(mapper, 0) != 0;
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_TRUE(gone);
}

}  // namespace
}  // namespace crane::test
