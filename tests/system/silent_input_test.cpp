// SPDX-License-Identifier: Apache-2.0
// Inputs that made a wrong map, lost a file or hung in silence: each is used rightly or refused and
// named. The rules are tested one by one in unit tests; here is what a user sees of them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "process.hpp"
#include "recording/image_file.hpp"
#include "recording/truth.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class SilentInput : public ::testing::Test {
 protected:
  SilentInput() { fs::copy(rig_recording(), rig_, fs::copy_options::recursive); }

  Finished map(const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"run", rig_, "--out", out_, "--domain", next_domain()};
    command.insert(command.end(), more.begin(), more.end());
    return test::run(command, folder_.path());
  }
  void expect(const Finished& run, int code, const std::string& needle) {
    EXPECT_EQ(run.code, code) << run.output;
    EXPECT_NE(run.output.find(needle), std::string::npos) << run.output;
  }
  [[nodiscard]] nlohmann::json report() const {
    return nlohmann::json::parse(text_of(out_ + "/report.json"));
  }
  void set_body(const std::string& camera, const std::string& matrix) {
    const std::string path = rig_ + "/" + camera + "/sensor.yaml";
    std::string text = text_of(path);
    const std::size_t from = text.find("data: [");
    std::ofstream(path) << text.replace(from, text.find(']', from) - from + 1, matrix);
  }
  /// Every image of the recording, changed and written as PNG.
  template <class Change>
  void change_images(Change change) {
    for (const char* camera : {"cam0", "cam1"}) {
      const std::string folder = rig_ + "/" + camera;
      std::vector<fs::path> files;
      for (const auto& entry : fs::directory_iterator(folder + "/data")) files.push_back(entry);
      for (const fs::path& file : files) {
        auto image = read_image(file, 1U << 20U);
        ASSERT_TRUE(image);
        for (std::uint8_t& p : image->bytes) p = change(p);
        fs::remove(file);
        ASSERT_TRUE(write_image(fs::path(file).replace_extension(".png"), *image));
      }
      std::string lines = text_of(folder + "/data.csv");
      for (std::size_t at = 0; (at = lines.find(".jpg", at)) != std::string::npos;)
        lines.replace(at, 4, ".png");
      std::ofstream(folder + "/data.csv") << lines;
    }
  }
  TempFolder folder_;
  const std::string rig_ = folder_ / "rig", out_ = folder_ / "out";
};

TEST_F(SilentInput, TheBodyFrameOfTheCamerasDoesNotMoveTheMap) {
  set_body("cam0", "data: [-1, 0, 0, 0.06, 0, -1, 0, 0.02, 0, 0, 1, 0, 0, 0, 0, 1]");
  set_body("cam1", "data: [-1, 0, 0, -0.06, 0, -1, 0, 0.02, 0, 0, 1, 0, 0, 0, 0, 1]");
  const Finished run = map();
  ASSERT_EQ(run.code, 0) << run.output;
  EXPECT_EQ(report()["judgement"]["unsafe"], 0);
  EXPECT_GE(report()["judgement"]["coverage"], 0.95);
  for (const auto& height : report()["heights"]) EXPECT_LE(height["error_percent"], 2) << height;
}

TEST_F(SilentInput, MillimetresAreNamed) {
  set_body("cam1", "data: [1, 0, 0, 120, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]");
  expect(map(), 2, "baseline 120 m");
}

TEST_F(SilentInput, ImagesTooDarkToTellAnObstacleFromTheFloorAreNotMapped) {
  change_images([](std::uint8_t p) { return static_cast<std::uint8_t>((p + 8) / 16); });
  expect(map(), 4, "6 x too dark");
  EXPECT_EQ(report()["frames"]["integrated"], 0);
}

TEST_F(SilentInput, SixteenBitImagesNeedTheirDepthSaid) {
  for (const char* camera : {"cam0", "cam1"})
    for (const auto& entry : fs::directory_iterator(rig_ + "/" + camera + "/data")) {
      const std::string path = entry.path();
      const auto image = read_image(path, 1U << 20U);
      ASSERT_TRUE(image);
      HeightMap deep;  // only its 16-bit PNG is wanted
      deep.columns = image->width;
      deep.rows = image->height;
      for (std::size_t i = 0; i < image->bytes.size(); i += image->channels)
        deep.height_mm.push_back(static_cast<std::uint16_t>(16 * image->bytes[i]));
      ASSERT_TRUE(write_height_map(folder_ / "deep.png", deep));
      fs::rename(folder_ / "deep.png", path);  // told by its content
    }
  const Finished unsaid = map();
  expect(unsaid, 2, "has 16 bits, and its sensor.yaml does not say how many of them count");
  expect(unsaid, 2, "write 'bits: 12'");
  for (const char* camera : {"cam0", "cam1"})
    std::ofstream(rig_ + "/" + camera + "/sensor.yaml", std::ios::app) << "bits: 12\n";
  const Finished said = map();
  ASSERT_EQ(said.code, 0) << said.output;
  EXPECT_EQ(report()["judgement"]["unsafe"], 0);
  EXPECT_GE(report()["judgement"]["coverage"], 0.95);
}

TEST_F(SilentInput, FogIsNamed) {
  change_images([](std::uint8_t p) { return static_cast<std::uint8_t>(150 + p / 20); });
  expect(map(), 4, "6 x without contrast");
}

/// Dark, but all is to be seen.
TEST_F(SilentInput, AnEighthOfTheLightIsEnough) {
  change_images([](std::uint8_t p) { return static_cast<std::uint8_t>((p + 4) / 8); });
  const Finished run = map();
  ASSERT_EQ(run.code, 0) << run.output;
  EXPECT_EQ(report()["judgement"]["unsafe"], 0);
}

TEST_F(SilentInput, ARunTouchesNothingThatNoRunMade) {
  fs::create_directories(out_ + "/state");
  fs::create_directories(out_ + "/logs");
  const std::vector<std::string> files = {"config.yaml", "map.pcd", "state/tile",
                                          "logs/mapper.log"};
  for (const std::string& file : files) std::ofstream(out_ + "/" + file) << "mine: " << file;
  expect(map(), 2, "holds files that no run made");
  for (const std::string& file : files) EXPECT_EQ(text_of(out_ + "/" + file), "mine: " + file);
  EXPECT_FALSE(fs::exists(out_ + "/report.json"));
  fs::remove_all(out_);
  std::ofstream(out_) << "a file";
  EXPECT_NE(map().code, 0);
  EXPECT_EQ(text_of(out_), "a file");
}

TEST_F(SilentInput, ResultsOfAnEarlierRunAreGoneBeforeTheNextBegins) {
  ASSERT_EQ(map().code, 0);
  ASSERT_TRUE(fs::exists(out_ + "/map.bt"));
  std::ofstream(out_ + "/notes.txt") << "of the engineer";
  change_images([](std::uint8_t p) { return static_cast<std::uint8_t>(p / 64); });
  const Finished second = map();
  EXPECT_EQ(second.code, 4) << second.output;
  EXPECT_FALSE(fs::exists(out_ + "/height_map.png"));
  EXPECT_FALSE(fs::exists(out_ + "/height_map_view.png"));
  EXPECT_EQ(report()["frames"]["integrated"], 0);
  EXPECT_EQ(text_of(out_ + "/notes.txt"), "of the engineer");
  // A mapper that serves from there afterwards keeps its state.
  fs::create_directories(out_ + "/state");
  std::ofstream(out_ + "/state/tile") << "of the mapper that serves";
  expect(map(), 2, "a folder 'state' that no run made");
  EXPECT_EQ(text_of(out_ + "/state/tile"), "of the mapper that serves");
}

/// Versions before this one left no marker.
TEST_F(SilentInput, ResultsOfAnOlderVersionAreReplacedUnlessSomethingElseIsThere) {
  fs::create_directories(out_);
  std::ofstream(out_ + "/report.json") << R"({"cranemap": {}, "run": {}})";
  std::ofstream(out_ + "/map.bt") << "old";
  std::ofstream(out_ + "/site.yaml") << "mine";
  expect(map(), 2, "holds files that no run made");
  EXPECT_EQ(text_of(out_ + "/map.bt"), "old");
  fs::remove(out_ + "/site.yaml");
  ASSERT_EQ(map().code, 0);
  EXPECT_NE(text_of(out_ + "/map.bt"), "old");
}

TEST_F(SilentInput, AFolderWhoseNameIsNotUtf8IsMappedAndReported) {
  const std::string old_disk = folder_ / "Kr\xE4n";
  fs::create_directory(old_disk);
  fs::rename(rig_, old_disk + "/rec");
  const Finished run =
      test::run({"run", old_disk + "/rec", "--out", old_disk + "/out", "--domain", next_domain()},
                folder_.path());
  ASSERT_EQ(run.code, 0) << run.output;
  const auto report = nlohmann::json::parse(text_of(old_disk + "/out/report.json"));
  EXPECT_EQ(report["run"]["recording"], (folder_ / "Kr\\xe4n/rec"));
}

TEST_F(SilentInput, InterfacesThatAreNoneAreNamedAtOnce) {
  for (const char* wrong : {"lo", "'::1'", "127.0.0.1/8"}) {
    std::ofstream(folder_ / "site.yaml") << "dds:\n  interfaces: [" << wrong << "]\n";
    expect(map({"--config", folder_ / "site.yaml"}), 2, "site.yaml:2: 'dds.interfaces'");
  }
  std::ofstream(folder_ / "site.yaml") << "dds:\n  interfaces: [203.0.113.7]\n";
  expect(map({"--config", folder_ / "site.yaml"}), 2, "203.0.113.7 is no address of this host");
}

TEST_F(SilentInput, ReadingsFromBeforeTheClockWasSetAreNamedRatherThanWaitedFor) {
  std::string lines = text_of(rig_ + "/cart0/data.csv");
  std::ofstream(rig_ + "/cart0/data.csv") << "5000000000,0.1\n" + lines;
  expect(map({"--rate", "real"}), 2, "cart0/data.csv: its time jumps by 53.9 years");
}

/// Exit code and what the shell's last command printed.
Finished shell(const std::string& command) {
  Finished out;
  std::FILE* pipe = popen(("timeout 20 bash -c \"" + command + "\" 2>&1").c_str(), "r");
  std::array<char, 256> text{};
  while (std::fgets(text.data(), text.size(), pipe) != nullptr) out.output += text.data();
  out.code = WEXITSTATUS(pclose(pipe));
  return out;
}

TEST_F(SilentInput, CommandsThatGoOnPrintingEndWithTheirReader) {
  const std::string cranemap = CRANEMAP_BIN_DIR "/cranemap";
  const Finished watch = shell(cranemap + " watch --domain " + next_domain() + " | head -1");
  EXPECT_EQ(watch.code, 0) << "124: still there after 20 s";
  const Finished follow =
      shell(cranemap + " status --follow --wait 100 --domain " + next_domain() + " | head -1");
  EXPECT_EQ(follow.code, 0) << follow.output;
}

TEST_F(SilentInput, OutputThatCannotBeWrittenIsAnError) {
  const std::string cranemap = CRANEMAP_BIN_DIR "/cranemap";
  for (const std::string& command : {std::string("--help"), "watch --domain " + next_domain()}) {
    const Finished full = shell(cranemap + " " + command + " > /dev/full");
    EXPECT_EQ(full.code, 3) << full.output;
    EXPECT_NE(full.output.find("standard output: cannot be written"), std::string::npos)
        << full.output;
  }
}

}  // namespace
}  // namespace crane::test
