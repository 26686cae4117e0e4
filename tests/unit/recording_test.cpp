// SPDX-License-Identifier: Apache-2.0
#include "recording/recording.hpp"
#include "recording/hoist_csv.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "recording/csv.hpp"
#include "recording/image_file.hpp"
#include "recording/recording_writer.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

/// A copy of the rig recording's calibration and times, without its images, to be spoilt.
class SpoiltRecording : public ::testing::Test {
 protected:
  SpoiltRecording() {
    for (const char* file :
         {"rig.yaml", "cam0/sensor.yaml", "cam0/data.csv", "cam1/sensor.yaml", "cam1/data.csv",
          "cart0/sensor.yaml", "cart0/data.csv", "trolley0/sensor.yaml", "trolley0/data.csv"}) {
      fs::create_directories(fs::path(folder_ / file).parent_path());
      fs::copy_file(test::rig_recording() + "/" + file, folder_ / file);
    }
  }
  void replace(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(folder_ / file);
    std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(folder_ / file) << text.replace(at, from.size(), to);
  }
  void append(const std::string& file, const std::string& line) {
    std::ofstream(folder_ / file, std::ios::app) << line << "\n";
  }
  /// The error must name what it is about.
  void expect_error(const std::string& needle, ErrorCode code) {
    const auto opened = Recording::open(folder_.path());
    ASSERT_FALSE(opened);
    EXPECT_NE(opened.error().text().find(needle), std::string::npos) << opened.error().text();
    EXPECT_EQ(opened.error().code, code);
    EXPECT_FALSE(opened.error().where.empty());
  }
  TempFolder folder_;
};

TEST_F(SpoiltRecording, OpensUnspoilt) {
  const auto opened = Recording::open(folder_.path());
  ASSERT_TRUE(opened) << opened.error().text();
  EXPECT_EQ(opened->frames().size(), 6U);
  EXPECT_NEAR(opened->rig().baseline_m(), 0.12, 1e-9);
  EXPECT_NEAR(opened->rig().camera_height_m(), 1.95, 1e-9);
}

TEST_F(SpoiltRecording, SaysWhichCalibrationIsMissing) {
  fs::remove(folder_ / "cam1/sensor.yaml");
  expect_error("cam1/sensor.yaml: no such file", ErrorCode::kConfiguration);
}

TEST_F(SpoiltRecording, SaysWhichCalibrationKeyIsMistyped) {
  replace("cam0/sensor.yaml", "intrinsics", "intrinsic");
  expect_error("unknown key 'intrinsic'", ErrorCode::kConfiguration);
  expect_error("'intrinsics' is missing", ErrorCode::kConfiguration);
}

TEST_F(SpoiltRecording, RefusesAMatrixThatIsNoRotation) {
  replace("rig.yaml", "0, -1, 0, 0", "0, -2, 0, 0");
  expect_error("rotation", ErrorCode::kConfiguration);
}

TEST_F(SpoiltRecording, RefusesSwappedCameras) {
  replace("cam1/sensor.yaml", "0.12", "-0.12");
  expect_error("swapped", ErrorCode::kConfiguration);
}

TEST_F(SpoiltRecording, RefusesUnequalLeftAndRightCounts) {
  append("cam0/data.csv", "1700000009000000000,a.jpg");
  expect_error("cam0 has 7 images, cam1 6", ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesImagesNotTakenTogether) {
  replace("cam1/data.csv", "1700000005000000000,", "1700000005040000000,");
  expect_error("40 ms apart", ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesTimeGoingBackwards) {
  append("cart0/data.csv", "1600000000000000000,1.0");
  expect_error("time does not increase", ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesADistanceThatIsNoNumberAndKeepsNan) {
  append("cart0/data.csv", "1700000009000000000,nan");
  const auto opened = Recording::open(folder_.path());
  ASSERT_TRUE(opened);
  EXPECT_TRUE(std::isnan(opened->cart().back().distance_m));
  for (const std::string bad : {"far", "0x10", "1,5", "1.5 m", "", "1_0"}) {
    const std::string line = "1700000009000000000," + bad + "\n";
    replace("trolley0/data.csv", "#timestamp [ns],distance [m]\n", "#\n");
    append("trolley0/data.csv", "1700000009000000000," + bad);
    expect_error("'" + bad + "'", ErrorCode::kBadData);
    replace("trolley0/data.csv", line, "");
    replace("trolley0/data.csv", "#\n", "#timestamp [ns],distance [m]\n");
  }
}

TEST_F(SpoiltRecording, RefusesAPathOutOfTheRecording) {
  replace("cam0/data.csv", "1700000000000000000.jpg", "../../../secret");
  expect_error("no file name", ErrorCode::kBadData);
}

/// Stamps of a clock that was not set yet: a play would wait for decades.
TEST_F(SpoiltRecording, RefusesReadingsFromBeforeTheClockWasSet) {
  for (const char* sensor : {"cart0", "trolley0"}) {
    const std::string file = std::string(sensor) + "/data.csv";
    replace(file, "#timestamp [ns],distance [m]\n", "#timestamp\n5000000000,0.5\n6000000000,0.5\n");
    expect_error(file + ": its time jumps by 53.9 years", ErrorCode::kBadData);
    expect_error("1970-01-01 00:00:06", ErrorCode::kBadData);
    replace(file, "5000000000,0.5\n6000000000,0.5\n", "");
  }
  append("cart0/data.csv", "4300000000000000000,1.0");
  expect_error("cart0/data.csv: its time jumps", ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesAStampOfAnotherTimeInImagesAndHoistToo) {
  fs::create_directories(folder_ / "hoist0");
  append("hoist0/data.csv", "5000000000,0.9");
  expect_error("hoist0/data.csv: its times (from 1970-01-01", ErrorCode::kBadData);
  append("hoist0/data.csv", "1700000000000000000,0.9");
  expect_error("hoist0/data.csv: its time jumps by", ErrorCode::kBadData);
  fs::remove_all(folder_ / "hoist0");
  for (const char* camera : {"cam0/data.csv", "cam1/data.csv"})
    append(camera, "4300000000000000000,a.jpg");
  expect_error("cam0/data.csv: its time jumps", ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesASensorWhoseClockWasNeverSet) {
  std::ofstream(folder_ / "cart0/data.csv") << "5000000000,0.5\n6000000000,0.5\n";
  expect_error("cart0/data.csv: its times (from 1970-01-01 00:00:05) are 53.9 years away",
               ErrorCode::kBadData);
}

TEST_F(SpoiltRecording, RefusesTimesThatAreNoNanoseconds) {
  for (const char* unit : {"", "000", "000000"}) {  // seconds, milliseconds, microseconds at 10 Hz
    for (const char* file : {"cam0/data.csv", "cam1/data.csv"}) {
      std::ofstream out(folder_ / file);
      for (int i = 0; i < 6; ++i)
        out << "170000000" << i << (std::string(unit) == "000000" ? "00000" : unit) << ",a.jpg\n";
    }
    expect_error("are no nanoseconds", ErrorCode::kBadData);
  }
}

/// What counts is one clock: since boot is one too, and a crane may stand still for a while.
TEST_F(SpoiltRecording, TakesTimesSinceBootAndLongPauses) {
  for (const char* file : {"cam0/data.csv", "cam1/data.csv", "cart0/data.csv", "trolley0/data.csv"})
    std::ofstream(folder_ / file) << "5000000000,1\n6000000000,1\n3000000000000,1\n";
  const auto opened = Recording::open(folder_.path());
  ASSERT_TRUE(opened) << opened.error().text();
}

TEST(TimeCsv, NamesFileAndLine) {
  const auto rows = parse_time_csv("# head\n5,a\nx,b\n", "data.csv");
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().where, "data.csv:3");
}

TEST(RecordingWriter, WritesWhatRecordingOpens) {
  const TempFolder folder;
  StereoRig rig = Recording::open(test::rig_recording())->rig();
  rig.left.k1 = -0.05;
  auto writer = RecordingWriter::create(folder / "r", rig, 10, {});
  ASSERT_TRUE(writer);
  const Image image{1280, 720, 1, std::vector<std::uint8_t>(1280 * 720, 7)};
  ASSERT_TRUE(writer->add_frame(5'000'000'000, image, image, "png"));
  ASSERT_TRUE(writer->add_cart(5'000'000'000, 1.2345));
  ASSERT_TRUE(writer->add_trolley(5'000'000'000, 2));
  ASSERT_TRUE(writer->close());
  const auto opened = Recording::open(folder / "r");
  ASSERT_TRUE(opened) << opened.error().text();
  EXPECT_DOUBLE_EQ(opened->rig().left.k1, -0.05);
  EXPECT_DOUBLE_EQ(opened->cart()[0].distance_m, 1.2345);
  const auto back = read_image(opened->frames()[0].left_file, 1'000'000);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->bytes, image.bytes);
}

TEST(HoistCsv, ReadsHeightAloneOrAllAndNamesWhatIsWrong) {
  const auto all = parse_hoist_csv("#time\n5,0.9\n7,1.5,0.1,2,1,0.5,-0.3,0.01,-0.02\n", "h.csv");
  ASSERT_TRUE(all) << all.error().text();
  ASSERT_EQ(all->size(), 2U);
  EXPECT_EQ((*all)[0].hook_height_m, 0.9);
  EXPECT_FALSE((*all)[0].has_load());
  EXPECT_TRUE((*all)[1].has_load());
  EXPECT_EQ((*all)[1].sway_m.y(), -0.02);
  for (const char* bad : {"5,\n", "5,x\n", "5,1,2,3,4,5,6,7,8,9\n", "5,1,-1\n", "5,1,0,1,nan\n",
                          "5,1,0,-2,1,1\n", "5,1,\n", "5,0x1\n", "5,1;2\n", "5,1e\n"}) {
    const auto read = parse_hoist_csv(bad, "h.csv");
    ASSERT_FALSE(read) << bad;
    EXPECT_NE(read.error().text().find("h.csv"), std::string::npos);
  }
}

}  // namespace
}  // namespace crane
