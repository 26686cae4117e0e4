// SPDX-License-Identifier: Apache-2.0
// A camera hangs three degrees crooked below an emulated crane, and nobody knows: the mount is
// measured from what the live topics said, and maps as exactly as the truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <Eigen/Geometry>
#include <fstream>

#include "recording/calibration.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

double number_after(const std::string& text, const std::string& name) {
  const auto at = text.find(name + "=");
  return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 1));
}

class MountLive : public ::testing::Test {
 protected:
  /// The scene of the commissioning, its camera crooked.
  void SetUp() override {
    std::ifstream in(CRANEMAP_SOURCE_DIR "/tests/data/commission_scene.yaml");
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::string height = "height_m: 1.95,";
    const auto at = text.find(height);
    ASSERT_NE(at, std::string::npos);
    text.insert(at + height.size(), " tilt_deg: [3, -1, 0],");
    std::ofstream(scene_) << text;
    const Finished simulated =
        run({"simulate", scene_, "--out", folder_ / "lap"}, folder_.path(), 100);
    ASSERT_EQ(simulated.code, 0) << simulated.output;
  }
  /// What a map of `recording`, placed by `rig`, is worth.
  std::string judged(const std::string& recording, const StereoRig& rig, const std::string& site,
                     const std::string& out) {
    const std::string placed = folder_ / ("placed-" + out);
    fs::copy(recording, placed, fs::copy_options::recursive);
    EXPECT_TRUE(write_rig(rig, placed, 4));
    const Finished mapped = run({"run", placed, "--out", folder_ / out, "--voxel", "0.02",
                                 "--config", site, "--rate", "max"},
                                folder_.path(), 100);
    EXPECT_EQ(mapped.code, 0) << mapped.output;
    const Finished judge =
        run({"evaluate", folder_ / (out + "/map.bt"), folder_ / "lap/truth"}, folder_.path(), 100);
    EXPECT_EQ(judge.code, 0) << judge.output;
    return judge.output;
  }
  TempFolder folder_;
  const std::string scene_ = folder_ / "crooked.yaml";
};

TEST_F(MountLive, ACrookedCameraMapsAsExactlyByWhatWasMeasuredAsByTheTruth) {
  Process crane({"cranemap", "emulate-crane", scene_, "--out", folder_ / "crane", "--domain",
                 next_domain(), "--rate", "4"},
                folder_ / "crane.txt");
  ASSERT_TRUE(eventually(20s, [&] { return fs::exists(folder_ / "crane/trolley"); }))
      << crane.output();
  const auto truth = read_rig(folder_ / "crane");
  ASSERT_TRUE(truth) << truth.error().text();
  StereoRig told = truth.value();
  told.T_map_camera_at_zero.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  told.T_map_camera_at_zero.translation().z() = 1.9;
  ASSERT_TRUE(write_rig(told, folder_ / "crane", 4));
  const std::string drive = folder_ / "drive", site = folder_ / "site";
  {
    Process services({"cranemap", "serve", "--site", folder_ / "crane", "--state",
                      folder_ / "state", "camera", "rangefinder"},
                     folder_ / "serve.txt");
    const Finished recorded =
        run({"record", "--site", folder_ / "crane", "--out", drive, "--for", "18s"}, folder_.path(),
            100);
    ASSERT_TRUE(recorded.code == 0 || recorded.code == 4) << recorded.output << services.output();
    services.signal(SIGTERM);
    EXPECT_EQ(services.wait(20), 0) << services.output();
  }
  crane.signal(SIGTERM);
  EXPECT_EQ(crane.wait(20), 0) << crane.output();

  const Finished mount =
      run({"calibrate", "mount", drive, "--config", folder_ / "crane/site.yaml", "--out", site},
          folder_.path(), 100);
  ASSERT_EQ(mount.code, 0) << mount.output;
  const auto measured = read_rig(site);
  ASSERT_TRUE(measured) << measured.error().text();
  const Eigen::Matrix3d off = measured.value().T_map_camera_at_zero.linear() *
                              truth.value().T_map_camera_at_zero.linear().transpose();
  EXPECT_LT(Eigen::AngleAxisd(off).angle() * 180 / M_PI, 0.1) << mount.output;
  EXPECT_NEAR(measured.value().camera_height_m(), truth.value().camera_height_m(), 0.003)
      << mount.output;

  const std::string by_measure = judged(drive, measured.value(), site + "/site.yaml", "measured");
  const std::string by_truth =
      judged(drive, truth.value(), folder_ / "crane/site.yaml", "by-truth");
  EXPECT_EQ(number_after(by_truth, "unsafe"), 0) << by_truth;
  EXPECT_EQ(number_after(by_measure, "unsafe"), 0) << by_measure;
  EXPECT_LE(number_after(by_measure, "err_median_m"),
            number_after(by_truth, "err_median_m") + 0.002)
      << by_measure << by_truth;
  // As it was told, the watchdog lets nothing into a map.
  const Finished by_told =
      run({"run", drive, "--out", folder_ / "told", "--config", folder_ / "crane/site.yaml"},
          folder_.path(), 100);
  EXPECT_EQ(by_told.code, 4) << by_told.output;
  EXPECT_THAT(by_told.output, HasSubstr("the map is not to be relied on"));
}

}  // namespace
}  // namespace crane::test
