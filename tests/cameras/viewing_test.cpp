// SPDX-License-Identifier: Apache-2.0
// Pictures of which nobody says when they were taken: published to be looked at, mapped by nobody.

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "dds/endpoints.hpp"
#include "dds/participant.hpp"
#include "geometry/calibration_digest.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

class Viewing : public ::testing::Test {
 protected:
  void configure(const std::string& more) {
    std::ofstream(site()) << "dds: {domain: " << domain_ << "}\nhttp: {port: 0}\n"
                          << "camera: {source: gstreamer, width: 1280, height: 720, pipeline: '"
                          << "videotestsrc ! video/x-raw,format=GRAY8,width=2560,height=720,"
                          << "framerate=5/1 ! appsink'" << more << "}\n";
  }
  [[nodiscard]] std::string site() const { return folder_ / "site.yaml"; }
  /// Until a service says it, at most 30 s.
  static bool says(Process& service, const std::string& text) {
    return eventually(30s, [&] { return service.output().find(text) != std::string::npos; });
  }
  TempFolder folder_;
  std::string domain_ = next_domain();
};

TEST_F(Viewing, PicturesWithoutATimeAreSeenAndNeverMapped) {
  configure(", for_viewing: true");
  dds::Settings settings;
  settings.domain = static_cast<std::uint32_t>(std::stoi(domain_));
  const auto participant = *dds::Participant::create(settings, "test");
  auto reader = *dds::Reader<dds::StereoFrameTopic>::create(participant, nullptr);
  Process stereo({"cranemap-stereo", "--config", site(), "--calibration", rig_recording()},
                 folder_ / "stereo.txt");
  Process camera({"cranemap-camera", "--config", site()}, folder_ / "camera.txt");
  std::uint64_t calibration = 0;
  EXPECT_TRUE(eventually(30s, [&] {
    if (auto sample = reader.take()) calibration = (*sample)->calibration();
    return calibration != 0;
  })) << camera.output();
  EXPECT_EQ(calibration, kCalibrationForViewing);
  EXPECT_TRUE(says(stereo, "the camera's pictures are for viewing only")) << stereo.output();
  camera.signal(SIGTERM);
  EXPECT_EQ(camera.wait(20), 0) << camera.output();
}

TEST_F(Viewing, UnlessTheyAreAskedForTheyAreRefusedWithWhatToDo) {
  configure("");
  Process camera({"cranemap-camera", "--config", site()}, folder_ / "camera.txt");
  EXPECT_TRUE(says(camera, "does not say when pictures were taken")) << camera.output();
  EXPECT_NE(camera.output().find("camera.for_viewing: true"), std::string::npos);
  camera.signal(SIGTERM);
  EXPECT_EQ(camera.wait(20), 0) << camera.output();
}

}  // namespace
}  // namespace crane::test
