// SPDX-License-Identifier: Apache-2.0
// What users get wrong, and what disks do: each a clear error that says what, where, what to do.

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "process.hpp"
#include "recording/image_file.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;

class BadInput : public ::testing::Test {
 protected:
  Finished run_rig(const std::string& recording, const std::vector<std::string>& more = {},
                   const std::string& out = "") {
    std::vector<std::string> command = {
        "run",     recording, "--out",    out.empty() ? folder_ / "out" : out,
        "--voxel", "0.05",    "--domain", next_domain()};
    command.insert(command.end(), more.begin(), more.end());
    return test::run(command, folder_.path());
  }
  std::string copy_rig() {
    fs::copy(rig_recording(), folder_ / "rig", fs::copy_options::recursive);
    return folder_ / "rig";
  }
  void expect(const Finished& run, int code, const std::string& needle) {
    EXPECT_EQ(run.code, code) << run.output;
    EXPECT_NE(run.output.find(needle), std::string::npos) << run.output;
  }
  TempFolder folder_;
};

TEST_F(BadInput, MissingRecording) {
  expect(run_rig("/nowhere"), 2, "/nowhere: no such folder");
}

TEST_F(BadInput, MissingCalibration) {
  const std::string rig = copy_rig();
  fs::remove(rig + "/rig.yaml");
  expect(run_rig(rig), 2, "rig.yaml: no such file");
}

TEST_F(BadInput, UnknownConfigurationKey) {
  std::ofstream(folder_ / "site.yaml") << "mapper:\n  voxels: 3\n";
  expect(run_rig(rig_recording(), {"--config", folder_ / "site.yaml"}), 2,
         "site.yaml:2: unknown key 'mapper.voxels'");
}

TEST_F(BadInput, AConfigurationIsShownComparedAndExplained) {
  std::ofstream(folder_ / "site.yaml") << "mapper: {voxel_m: 0.04}\n";
  const auto config = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "config");
    return test::run(more, folder_.path());
  };
  const Finished changed = config({"changed", "--config", folder_ / "site.yaml", "--crane", "3"});
  EXPECT_EQ(changed.code, 0);
  EXPECT_EQ(changed.output, "crane: 3   # default: 1\nmapper.voxel_m: 0.04   # default: 0\n");
  // What is shown is a configuration that says the same.
  const Finished shown = config({"--config", folder_ / "site.yaml"});
  EXPECT_EQ(shown.code, 0);
  std::ofstream(folder_ / "shown.yaml") << shown.output;
  EXPECT_EQ(config({"changed", "--config", folder_ / "shown.yaml"}).output,
            "mapper.voxel_m: 0.04   # default: 0\n");
  expect(config({"describe", "mapper.voxel_m"}), 0, "mapper.voxel_m [m]: edge of a voxel");
  expect(config({"describe", "mapper.voxel"}), 2, "'mapper.voxel_m' is meant?");
  std::ofstream(folder_ / "bad.yaml") << "mapper:\n  voxel_cm: 4\n";
  expect(config({"show", "--config", folder_ / "bad.yaml"}), 2, "bad.yaml:2: unknown key");
  expect(config({"--domain", "233"}), 2, "233");
}

TEST_F(BadInput, AMapFileThatWasCutIsNotJudged) {
  const std::string header = "# Octomap OcTree file\nid ColorOcTree\nsize 900\nres 0.05\ndata\n";
  std::ofstream(folder_ / "cut.ot", std::ios::binary) << header << std::string(70, '\x01');
  expect(test::run({"evaluate", folder_ / "cut.ot", rig_recording() + "/truth"}, folder_.path()), 2,
         "is cut");
  std::ofstream(folder_ / "empty.bt") << "";
  expect(test::run({"evaluate", folder_ / "empty.bt", rig_recording() + "/truth"}, folder_.path()),
         2, "is no OctoMap file");
}

TEST_F(BadInput, AFaultThatCannotBeSimulatedIsNamedWithThoseThatCan) {
  for (const char* fault : {"toe=1", "toe_in", "toe_in=many"})
    expect(test::run({"simulate", CRANEMAP_SOURCE_DIR "/shared/sim/scenes/rig.yaml", "--out",
                      folder_ / "spoilt", "--fault", fault},
                     folder_.path()),
           2, "trolley_");
  EXPECT_FALSE(fs::exists(folder_ / "spoilt"));
}

TEST_F(BadInput, UnknownOption) {
  expect(test::run({"run", rig_recording(), "--out", folder_ / "out", "--vocsel", "x"},
                   folder_.path()),
         2, "--vocsel");
}

TEST_F(BadInput, TruncatedImageIsNamedCountedAndTheRestIsMapped) {
  const std::string rig = copy_rig();
  fs::resize_file(rig + "/cam0/data/1700000002000000000.jpg", 20'000);
  const Finished run = run_rig(rig);
  expect(run, 4, "5 in the map");
  expect(run, 4, "1 x image unreadable or of wrong size");
}

TEST_F(BadInput, ImagesOfAnotherSizeThanTheCalibration) {
  const std::string rig = copy_rig();
  for (const char* camera : {"/cam0/sensor.yaml", "/cam1/sensor.yaml"}) {
    std::ifstream file(rig + camera);
    std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    content.replace(content.find("[1280, 720]"), 11, "[1024, 600]");
    content.replace(content.find("639.5, 359.5"), 12, "511.5, 299.5");
    std::ofstream(rig + camera) << content;
  }
  const Finished run = run_rig(rig);
  expect(run, 4, "6 x image unreadable or of wrong size");
}

TEST_F(BadInput, RangefinderGapLeavesFramesOutAndSaysWhy) {
  const std::string rig = copy_rig();
  std::ifstream in(rig + "/cart0/data.csv");
  std::string kept;
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with("1700000002")) kept += line + "\n";
  std::ofstream(rig + "/cart0/data.csv") << kept;
  const Finished run = run_rig(rig);
  expect(run, 4, "5 in the map, 1 rejected");
  expect(run, 4, "1 x no position: gap around the exposure");
}

/// A pair that tells nothing leaves the map as it is, is named and counted; the others are mapped.
TEST_F(BadInput, ABlackImageIsNamedAndTheMapUntouchedByIt) {
  const std::string rig = copy_rig();
  Image black{1280, 720, 3, std::vector<std::uint8_t>(std::size_t{3} * 1280 * 720, 2)};
  ASSERT_TRUE(write_image(rig + "/cam1/data/1700000002000000000.jpg", black));
  const Finished run = run_rig(rig);
  expect(run, 4, "5 in the map, 1 rejected");
  expect(run, 4, "1 x right image black");
}

TEST_F(BadInput, AFrozenCameraIsNamedAndItsFramesAreNotMapped) {
  const std::string rig = copy_rig();
  for (const char* frame : {"3", "4", "5"})
    fs::copy_file(rig + "/cam0/data/1700000002000000000.jpg",
                  rig + "/cam0/data/170000000" + frame + "000000000.jpg",
                  fs::copy_options::overwrite_existing);
  const Finished run = run_rig(rig);
  expect(run, 4, "3 in the map, 3 rejected");
  expect(run, 4, "3 x left image frozen");
}

TEST_F(BadInput, SwappedCamerasMapNothingAndSaySo) {
  const std::string rig = copy_rig();
  fs::rename(rig + "/cam0/data", rig + "/other");
  fs::rename(rig + "/cam1/data", rig + "/cam0/data");
  fs::rename(rig + "/other", rig + "/cam1/data");
  const Finished run = run_rig(rig);
  expect(run, 4, "0 in the map, 6 rejected");
  expect(run, 4, "6 x hardly a pixel matches");
}

TEST_F(BadInput, UnwritableOutput) {
  expect(run_rig(rig_recording(), {}, "/proc/cranemap"), 3, "/proc/cranemap: cannot be written");
}

TEST_F(BadInput, FullDisk) {
  fs::create_directory(folder_ / "small");
  if (mount("tmpfs", (folder_ / "small").c_str(), "tmpfs", 0, "size=200k") != 0)
    GTEST_SKIP() << "this user may not mount a small file system to fill";
  const Finished run = run_rig(rig_recording(), {}, folder_ / "small/out");
  umount((folder_ / "small").c_str());
  expect(run, 3, "cannot be written: No space left on device -> check permissions and free space");
}

TEST_F(BadInput, ASecondMapperForTheSameCraneRefuses) {
  const std::string domain = next_domain();
  std::ofstream(folder_ / "site.yaml") << "dds: {domain: " << domain << "}\n";
  const std::string site = folder_ / "site.yaml";
  Process first({"cranemap-mapper", "--config", site, "--calibration", rig_recording()},
                folder_ / "first.log");
  for (int i = 0; i < 500 && first.output().find("serving crane") == std::string::npos; ++i)
    usleep(20'000);
  Process second({"cranemap-mapper", "--config", site, "--calibration", rig_recording()},
                 folder_ / "second.log");
  EXPECT_EQ(second.wait(20), 3);
  EXPECT_NE(second.output().find("another mapper already serves crane 1"), std::string::npos)
      << second.output();
  EXPECT_TRUE(first.running());
}

/// A program under a limit of the shell, or as another user: its exit code and what it said.
Finished shell(const std::string& before, const std::string& command, const TempFolder& folder) {
  const std::string output = folder / "output";
  const int status = std::system(("{ " + before + " timeout -k 1 15 " CRANEMAP_BIN_DIR "/" +
                                  command + "; } > " + output + " 2>&1 < /dev/null")
                                     .c_str());
  std::ifstream file(output);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128,
          {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}};
}

TEST_F(BadInput, FoldersThatThisUserMayNotReadAreNamed) {
  if (geteuid() != 0) GTEST_SKIP() << "only root becomes another user";
  const auto as_nobody = [&](const std::string& command) {
    return shell("setpriv --reuid 65534 --regid 65534 --clear-groups", command, folder_);
  };
  fs::permissions(folder_.path(), fs::perms(0755));
  if (as_nobody("cranemap --version").code != 0)
    GTEST_SKIP() << "another user may not run the build";
  fs::create_directories(folder_ / "locked/in");
  fs::copy(rig_recording(), folder_ / "locked/in/rig", fs::copy_options::recursive);
  const std::string rig = copy_rig();
  fs::permissions(rig + "/cart0/data.csv", fs::perms::none);
  const std::string locked = folder_ / "locked";
  const std::string domain = next_domain();
  const auto site = [&](const std::string& name, const std::string& more) {
    std::ofstream(folder_ / name) << "http: {port: 0}\ndds: {domain: " << domain << more << "}\n";
    return " --config " + (folder_ / name);
  };
  const std::string plain = site("plain.yaml", "");
  const std::string secured = site("secured.yaml", ", security: " + locked);
  const std::string profiled =
      site("profile.yaml", ", profile_file: " + locked + "/in/x.xml, profile_name: a");
  const std::string calibration = " --calibration " + rig_recording();
  for (const int mode : {0, 0644}) {  // neither listed nor entered; listed
    fs::permissions(locked, fs::perms(mode));
    for (const std::string& command :
         {"cranemap-stereo" + plain + " --calibration " + locked + "/in/rig",
          "cranemap-mapper" + plain + " --calibration " + locked + "/in/rig",
          "cranemap-camera" + plain + " " + locked + "/in/rig",
          "cranemap-rangefinder" + plain + " " + rig,  // a file of it
          "cranemap-mapper" + plain + calibration + " --state " + locked,
          "cranemap-mapper" + plain + calibration + " --state " + locked + "/in/state",
          "cranemap-mapper" + profiled + calibration, "cranemap-mapper" + secured + calibration,
          "cranemap-mapper --config " + locked + "/in/site.yaml" + calibration,
          "cranemap doctor" + secured, "cranemap doctor" + profiled,
          "cranemap evaluate " + locked + "/in/map.bt " + rig_recording() + "/truth",
          "cranemap run " + locked + "/in/rig --out " + (folder_ / "out"),
          "cranemap run " + rig_recording() + " --out " + locked + "/in/out",
          "cranemap simulate " + locked + "/in/scene.yaml --out " + (folder_ / "s")}) {
      const Finished done = as_nobody(command);
      EXPECT_TRUE(done.code == 2 || done.code == 3) << command << ": " << done.code << done.output;
      EXPECT_EQ(done.output.find("terminate"), std::string::npos) << command << done.output;
    }
  }
  fs::permissions(locked, fs::perms(0755));
}

TEST_F(BadInput, LimitsOfTheShellAreSaid) {
  std::ofstream(folder_ / "site.yaml")
      << "http: {port: 0}\ndds: {domain: " << next_domain() << "}\n";
  const std::string stereo = "cranemap-stereo --config " + (folder_ / "site.yaml") +
                             " --calibration /nowhere";  // ends where it gets through
  int refused = 0;
  for (const char* limit : {"-n 4", "-n 6", "-n 9", "-n 14", "-n 17", "-v 150000", "-v 200000",
                            "-v 250000", "-v 300000", "-v 400000"}) {
    const Finished done = shell(std::string("ulimit ") + limit + ";", stereo, folder_);
    if (done.code == 127) continue;  // not even its libraries
    EXPECT_TRUE(done.code == 3 || done.code == 2) << limit << ": " << done.code << done.output;
    EXPECT_NE(done.output.find("ERROR"), std::string::npos) << limit << done.code << done.output;
    refused += done.code == 3;
  }
  EXPECT_GE(refused, 4);
}

TEST_F(BadInput, EvaluateAndSimulateNameTheirFile) {
  std::ofstream(folder_ / "no.bt") << "nothing";
  expect(test::run({"evaluate", folder_ / "no.bt", rig_recording() + "/truth"}, folder_.path()), 2,
         "no.bt");
  expect(test::run({"simulate", "/nowhere.yaml", "--out", folder_ / "s"}, folder_.path()), 2,
         "/nowhere.yaml: no such file");
}

}  // namespace
}  // namespace crane::test
