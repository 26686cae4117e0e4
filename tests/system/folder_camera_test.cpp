// SPDX-License-Identifier: Apache-2.0
// A camera whose software writes files: pairs that appear in a folder become a map.

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "base/clock.hpp"
#include "crane/client/map.hpp"
#include "recording/recording.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

TEST(FolderCamera, PairsThatAppearBecomeAMapAndWhatIsWrongIsSaid) {
  const TempFolder folder;
  const std::string domain = next_domain(), in = folder / "pictures";
  for (const char* side : {"left", "right"}) fs::create_directories(in + "/" + side);
  std::ofstream(folder / "site.yaml")
      << "dds: {domain: " << domain << "}\nhttp: {port: 0}\n"
      << "mapper: {voxel_m: 0.02}\ncamera: {source: folder, path: " << in << "}\n";
  Process serve({"cranemap", "serve", "--config", folder / "site.yaml", "--calibration",
                 rig_recording(), "mapper", "stereo", "camera"},
                folder / "serve.txt");
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  ASSERT_TRUE(eventually(30s, [&] { return map->status().heard; })) << serve.output();

  // A picture cut off on its way: named, counted, and no end of anything.
  for (const char* side : {"left", "right"})
    std::ofstream(in + "/" + side + "/1700000000000000000.jpg") << "\xFF\xD8\xFF\xE0 cut";
  EXPECT_TRUE(eventually(30s, [&] {
    return serve.output().find("left/1700000000000000000.jpg") != std::string::npos;
  })) << serve.output();

  const auto recording = Recording::open(rig_recording());
  ASSERT_TRUE(recording);
  const TimeNs start = SystemClock().now() + 2 * kNsPerSecond;
  Process rangefinder({"cranemap-rangefinder", rig_recording(), "--config", folder / "site.yaml",
                       "--start-at", std::to_string(start)},
                      folder / "rangefinder.txt");
  std::uint64_t put = 0;
  for (const RecordedFrame& frame : recording->frames()) {
    const TimeNs time = frame.time - recording->start() + start;
    ASSERT_TRUE(eventually(30s, [&] { return SystemClock().now() >= time; }));
    const std::string name = std::to_string(time) + ".jpg";
    // One by the custom of renaming, the other as cp does it.
    fs::copy_file(frame.left_file, in + "/left/." + name);
    fs::rename(in + "/left/." + name, in + "/left/" + name);
    fs::copy_file(frame.right_file, in + "/right/" + name);
    ++put;
    ASSERT_TRUE(eventually(30s,
                           [&] {
                             const client::Status s = map->status();
                             return s.frames_integrated + s.frames_rejected >= put;
                           }))
        << put << "\n"
        << serve.output();
  }
  ASSERT_TRUE(eventually(20s, [&] { return map->status().complete; }));
  EXPECT_EQ(map->status().frames_integrated, 6U);
  EXPECT_EQ(map->status().frames_missing, 0U);
  EXPECT_NE(map->height(0.75, 0.55).surface, client::Surface::kUnknown);
  serve.signal(SIGTERM);
  EXPECT_EQ(serve.wait(20), 0) << serve.output();
}

TEST(FolderCamera, ASiteWithoutACameraAndWithoutARecordingIsRefusedWithWhatToDo) {
  const TempFolder folder;
  Process none({"cranemap-camera"}, folder / "none.txt");
  EXPECT_EQ(none.wait(20), 2);
  EXPECT_NE(none.output().find("set camera.source"), std::string::npos) << none.output();
  std::ofstream(folder / "site.yaml") << "camera: {source: folder}\n";
  Process nowhere({"cranemap-camera", "--config", folder / "site.yaml"}, folder / "nowhere.txt");
  EXPECT_EQ(nowhere.wait(20), 2);
  EXPECT_NE(nowhere.output().find("'camera.path' must name the folder"), std::string::npos)
      << nowhere.output();
}

}  // namespace
}  // namespace crane::test
