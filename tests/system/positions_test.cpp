// SPDX-License-Identifier: Apache-2.0
// Rangefinders that lie, calibrations that differ, mappers that do not hear each other: nothing is
// mapped wrong, and it is said.

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bounds.h"
#include "crane/client/map.hpp"
#include "process.hpp"
#include "system/live_services.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class Positions : public ::testing::Test {
 protected:
  Positions() { fs::copy(rig_recording(), rig(), fs::copy_options::recursive); }
  [[nodiscard]] std::string rig() const { return folder_ / "rig"; }

  /// Every reading of an axis as `change` makes it; the first argument is its time.
  void spoil(const std::string& axis, const std::function<double(std::int64_t, double)>& change) {
    const std::string path = rig() + "/" + axis + "/data.csv";
    std::ifstream file(path);
    std::ostringstream out;
    for (std::string line; std::getline(file, line);) {
      const auto comma = line.find(',');
      if (line[0] == '#' || comma == std::string::npos) {
        out << line << "\n";
        continue;
      }
      const std::string time = line.substr(0, comma);
      out << time << "," << change(std::stoll(time), std::stod(line.substr(comma + 1))) << "\n";
    }
    file.close();
    fs::remove(path);
    std::ofstream(path) << out.str();
  }
  nlohmann::json map(int code, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"run",     rig(),  "--out",    folder_ / "out",
                                        "--voxel", "0.05", "--domain", next_domain()};
    command.insert(command.end(), more.begin(), more.end());
    const Finished run = test::run(command, folder_.path());
    EXPECT_EQ(run.code, code) << run.output;
    std::ifstream file(folder_ / "out/report.json");
    return nlohmann::json::parse(file);
  }
  TempFolder folder_;
};

constexpr std::int64_t kFirst = 1'700'000'000'000'000'000, kSecond = 1'000'000'000;

TEST_F(Positions, AFrameBesideAReadingThatCannotBeIsNotUsedAndTheCauseIsNamed) {
  struct Lie {
    std::string axis;
    double says_m;
    std::string cause;
  };
  for (const Lie& lie :
       {Lie{"cart0", 0, "cart reading out of range"},
        Lie{"trolley0", 0, "trolley reading out of range"},
        Lie{"cart0", 39.9, "cart reading jumped farther than a cart can move"},
        Lie{"trolley0", 2.1, "trolley reading jumped farther than a trolley can move"}}) {
    SCOPED_TRACE(lie.axis + " " + std::to_string(lie.says_m));
    fs::remove_all(rig());
    fs::copy(rig_recording(), rig(), fs::copy_options::recursive);
    spoil(lie.axis, [&](std::int64_t time, double m) {
      return time == kFirst + 2 * kSecond ? lie.says_m : m;
    });
    const auto report = map(4);
    EXPECT_EQ(report["frames"]["integrated"], 5);
    EXPECT_EQ(report["frames"]["rejected"], 1);
    EXPECT_GE(report["services"]["mapper"]["dropped"][lie.cause], 1) << report["services"];
    EXPECT_EQ(report["services"]["mapper"]["dropped"]
                    ["no position: a reading beside the exposure is doubtful"],
              1);
    EXPECT_LE(report["judgement"]["phantom"], 0.001);
  }
}

TEST_F(Positions, ARangefinderAtTheFarEndIsRefusedUntilItsDirectionIsConfigured) {
  spoil("cart0", [](std::int64_t, double m) { return 3 - m; });
  const auto refused = map(4);
  EXPECT_EQ(refused["frames"]["integrated"], 1) << "the first contradicts nothing yet";
  EXPECT_EQ(refused["services"]["mapper"]["dropped"]
                   ["frame contradicts the map: its position must be wrong"],
            5);
  std::ofstream(folder_ / "site.yaml") << "mapper: {cart_direction: -1, cart_offset_m: 3}\n";
  const auto mapped = map(0, {"--config", folder_ / "site.yaml"});
  EXPECT_EQ(mapped["judgement"]["unsafe"], 0);
  EXPECT_GE(mapped["judgement"]["coverage"], 0.95);
}

TEST_F(Positions, AfterAJumpThatStaysNoFrameIsMappedWrong) {
  spoil("cart0", [](std::int64_t time, double m) {
    return time > kFirst + 2 * kSecond + kSecond / 25 ? m + 3 : m;  // while it stands still
  });
  const auto report = map(4);
  EXPECT_EQ(report["frames"]["integrated"], 3);
  EXPECT_LE(report["judgement"]["phantom"], 0.001);
}

TEST(Calibration, AMapperWithAnotherOneThanItsStereoUsesNothingAndSaysWhy) {
  const TempFolder folder;
  const std::string other = folder / "other";
  fs::copy(rig_recording(), other, fs::copy_options::recursive);
  std::ifstream file(other + "/rig.yaml");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  file.close();
  const auto at = text.find("data: [");
  ASSERT_NE(at, std::string::npos);
  // The mount stands 7 cm farther along: everything else is as it was.
  const auto translation = text.find(',', text.find(',', text.find(',', at) + 1) + 1) + 1;
  const double x = std::stod(text.substr(translation));
  text.replace(translation, text.find(',', translation) - translation, std::to_string(x + 0.07));
  fs::remove(other + "/rig.yaml");
  std::ofstream(other + "/rig.yaml") << text;
  const std::string domain = next_domain();
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\n";
  const std::string site = folder / "site.yaml";
  Process mapper({"cranemap-mapper", "--config", site, "--calibration", other},
                 folder / "mapper.txt");
  Process stereo({"cranemap-stereo", "--config", site, "--calibration", rig_recording()},
                 folder / "stereo.txt");
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  Process rangefinder(
      {"cranemap-rangefinder", "--config", site, rig_recording(), "--stream", "5", "--loop"},
      folder / "r.txt");
  Process camera({"cranemap-camera", "--config", site, rig_recording(), "--stream", "5", "--loop"},
                 folder / "c.txt");
  EXPECT_TRUE(eventually(20s, [&] {
    const client::Status s = map->status();
    return s.reason_code == v1::MAP_OTHER_CALIBRATION && s.frames_rejected > 0 && !s.valid;
  })) << mapper.output();
  EXPECT_EQ(map->status().frames_integrated, 0U);
  EXPECT_NE(mapper.output().find("another calibration"), std::string::npos);
}

TEST(Watchdog, ACameraThatHangsLowerThanToldIsNamedByStatusAndItsFramesAreNotUsed) {
  const TempFolder folder;
  const std::string told = folder / "told";
  fs::copy(rig_recording(), told, fs::copy_options::recursive);
  std::ifstream file(told + "/rig.yaml");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  file.close();
  // The last number of the third row of T_world_cam0: 4 cm higher than it is.
  auto at = text.find("data: [");
  ASSERT_NE(at, std::string::npos);
  for (int number = 0; number < 11; ++number) at = text.find(',', at + 1);
  const auto end = text.find(',', at + 1);
  text.replace(at + 1, end - at - 1, std::to_string(std::stod(text.substr(at + 1)) + 0.04));
  fs::remove(told + "/rig.yaml");
  std::ofstream(told + "/rig.yaml") << text;
  const std::string domain = next_domain();
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\n";
  const std::string site = folder / "site.yaml";
  Process mapper({"cranemap-mapper", "--config", site, "--calibration", told},
                 folder / "mapper.txt");
  Process stereo({"cranemap-stereo", "--config", site, "--calibration", told},
                 folder / "stereo.txt");
  Process rangefinder({"cranemap-rangefinder", "--config", site, told, "--stream", "5", "--loop"},
                      folder / "r.txt");
  Process camera({"cranemap-camera", "--config", site, told, "--stream", "5", "--loop"},
                 folder / "c.txt");
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  EXPECT_TRUE(eventually(40s, [&] {
    const client::Status s = map->status();
    return s.reason_code == v1::MAP_CALIBRATION_WRONG && !s.valid;
  })) << mapper.output();
  EXPECT_LE(map->status().frames_integrated, 3U);
  const Finished status = run({"status", "--wait", "3", "--domain", domain}, folder.path());
  EXPECT_EQ(status.code, 3) << "a map that is not valid";
  for (const char* said : {"valid: false", "reason_code: 11", "height: the floor lies off by 0.0",
                           "rig.yaml", "watch_floor_m: {value: 0.0"})
    EXPECT_NE(status.output.find(said), std::string::npos) << said << "\n" << status.output;
}

TEST(Succession, WhoBeganWithNothingGivesWayToTheMapperThatHasTheMap) {
  const TempFolder folder;
  const std::string domain = next_domain();
  auto services = live_services(folder, domain);
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  ASSERT_TRUE(eventually(30s, [&] {
    const client::Status s = map->status();
    return s.complete && s.frames_integrated >= 4;
  })) << services.front().output();
  services.back().signal(SIGSTOP);  // the camera: nothing new comes
  ASSERT_TRUE(map->wait_until_complete(10s));
  const client::Status before = map->status();
  services.front().signal(SIGSTOP);  // the mapper is held up, and not heard
  Process standby({"cranemap-mapper", "--config", folder / "site.yaml", "--calibration",
                   rig_recording(), "--standby"},
                  folder / "standby.txt");
  ASSERT_TRUE(eventually(20s, [&] { return map->status().mapper != before.mapper; }))
      << standby.output();
  EXPECT_NE(map->status().map_id, before.map_id);
  services.front().signal(SIGCONT);
  EXPECT_TRUE(eventually(20s, [&] {
    const client::Status s = map->status();
    return s.mapper == before.mapper && s.map_id == before.map_id && s.complete;
  })) << services.front().output();
  EXPECT_EQ(map->status().tiles, before.tiles);
  EXPECT_EQ(standby.wait(10), 3) << standby.output();
  EXPECT_TRUE(services.front().running());
  services.back().signal(SIGCONT);
  EXPECT_TRUE(eventually(20s, [&] { return map->status().valid; })) << map->status().reason;
}

}  // namespace
}  // namespace crane::test
