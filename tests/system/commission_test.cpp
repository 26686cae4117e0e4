// SPDX-License-Identifier: Apache-2.0
// `cranemap commission` on an emulated crane, from an empty folder to a valid map, with what
// technicians do wrong on the way: each is told what to do, and goes on where they were.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <list>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>
#include <thread>

#include "config/site_config.hpp"
#include "crane/client/map.hpp"
#include "http/client.hpp"
#include "recording/calibration.hpp"
#include "recording/image_file.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"
#include "unit/board_images.hpp"

namespace crane::test {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

const std::string kScene = CRANEMAP_SOURCE_DIR "/tests/data/commission_scene.yaml";
constexpr BoardCamera kCamera{640, 480, 700, 319.5, 239.5};  // the scene's
constexpr double kBaseline_m = 0.12;

/// Images of a board by the scene's cameras.
void render_board(const std::string& folder) {
  fs::create_directories(folder);
  const Board board = parse_board("chessboard:9x6:0.02").value();
  const Eigen::Vector3d middle = 0.5 * (board.corners().front() + board.corners().back());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> one(-1, 1);
  for (int i = 0; i < 16; ++i) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = (Eigen::AngleAxisd(0.7 * one(random), Eigen::Vector3d::UnitX()) *
                  Eigen::AngleAxisd(0.7 * one(random), Eigen::Vector3d::UnitY()))
                     .toRotationMatrix();
    const double z = 0.5 + 0.1 * (one(random) + 1);
    T.translation() = Eigen::Vector3d((i % 4 - 1.5) * 0.04 + 0.06, (i / 4 % 3 - 1) * 0.07, z) -
                      T.linear() * middle;
    for (const bool right : {false, true}) {
      Eigen::Isometry3d seen = T;
      if (right) seen.translation().x() -= kBaseline_m;
      ASSERT_TRUE(
          write_image(folder + (right ? "/right" : "/left") + std::to_string(10 + i) + ".png",
                      render(board, seen, kCamera).image)
              .ok());
    }
  }
}

/// The camera's pictures as they come, changed by what somebody did to the camera.
class Meddler {
 public:
  enum Mode { kFine, kCapRight, kLightOff, kSwapped, kBumped };
  Meddler(std::string from, std::string to)
      : from_(std::move(from)), to_(std::move(to)), thread_([this] { work(); }) {}
  ~Meddler() {
    stop_ = true;
    thread_.join();
  }
  std::atomic<Mode> mode{kFine};

 private:
  void work() {
    for (const char* side : {"left", "right"}) fs::create_directories(to_ + "/" + side);
    while (!stop_) {
      std::error_code failed;
      for (fs::directory_iterator at(from_ + "/right", failed), end; !failed && at != end;
           at.increment(failed)) {
        const std::string name = at->path().filename();
        if (name.front() == '.' || !done_.insert(name).second) continue;
        const Mode now = mode;
        for (const std::string side : {"left", "right"}) {
          const std::string other = side == "left" ? "right" : "left";
          auto image =
              read_image(from_ + "/" + (now == kSwapped ? other : side) + "/" + name, 64'000'000);
          if (!image) continue;
          if (now == kLightOff || (now == kCapRight && side == "right"))
            for (auto& byte : image.value().bytes) byte = static_cast<std::uint8_t>(byte / 40);
          if (now == kBumped) turn_down(image.value());
          const std::string file = to_ + "/" + side + "/" + name;
          (void)write_image(to_ + "/" + side + "." + name, image.value());
          fs::rename(to_ + "/" + side + "." + name, file, failed);
        }
      }
      std::this_thread::sleep_for(20ms);
    }
  }

  /// As if somebody had knocked against the camera: it looks a degree elsewhere. A turn about its
  /// centre, hence a homography; an image that was only shifted would not be one of a tilted
  /// camera.
  static void turn_down(Image& image) {
    const cv::Matx33d K(kCamera.f_px, 0, kCamera.cx_px, 0, kCamera.f_px, kCamera.cy_px, 0, 0, 1);
    cv::Matx33d R;
    cv::Rodrigues(cv::Vec3d(M_PI / 180, 0, 0), R);
    const cv::Mat before(int(image.height), int(image.width), CV_8UC(int(image.channels)),
                         image.bytes.data());
    cv::Mat after;
    cv::warpPerspective(before, after, K * R * K.inv(), before.size(), cv::INTER_LINEAR,
                        cv::BORDER_REFLECT);
    std::copy_n(after.data, image.bytes.size(), image.bytes.begin());
  }

  std::string from_, to_;
  std::set<std::string> done_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// One technician, who begins with an empty folder.
class Commission : public ::testing::Test {
 protected:
  void SetUp() override {
    render_board(folder_ / "board");
    crane_.emplace(
        std::vector<std::string>{"cranemap", "emulate-crane", kScene, "--out", folder_ / "crane",
                                 "--domain", domain_, "--rate", "4", "--keep"},
        folder_ / "crane.txt");
    ASSERT_TRUE(eventually(20s, [&] { return fs::exists(folder_ / "crane/trolley"); }))
        << crane_->output();
    meddler_.emplace(folder_ / "crane/pictures", folder_ / "pictures");
    auto site = read_site_config(folder_ / "crane/site.yaml");
    ASSERT_TRUE(site.ok());
    site.value().camera.path = folder_ / "pictures";
    site.value().camera.remove = true;
    site.value().http.port = 0;
    site_ = site.value();
    for (const auto& [key, value] :
         std::vector<std::pair<std::string, std::string>>{{"board", "chessboard:9x6:0.02"},
                                                          {"camera_height_m", "1.95"},
                                                          {"baseline_m", "0.12"},
                                                          {"board_images", folder_ / "board"},
                                                          {"drive_s", "16"},
                                                          {"object", "0.75,0.55,0.60"},
                                                          {"object_wait_s", "60"},
                                                          {"zones_right", "yes"}})
      answers_[key] = value;
  }

  Finished commission(std::vector<std::string> more = {}) {
    std::ofstream site(folder_ / "devices.yaml");
    site << "# The hall's keeper: tel. 4711\n" << to_yaml(site_);
    site.close();
    std::ofstream answers(folder_ / "answers.yaml");
    for (const auto& [key, value] : answers_) answers << key << ": '" << value << "'\n";
    answers.close();
    std::vector<std::string> command = {"commission", "--out", folder_ / "site", "--answers",
                                        folder_ / "answers.yaml"};
    if (!fs::exists(folder_ / "site/site.yaml"))
      command.insert(command.end(), {"--config", folder_ / "devices.yaml"});
    command.insert(command.end(), more.begin(), more.end());
    return run(command, folder_.path(), 200);
  }
  /// A mistake: the run fails, and says this.
  void expect_failure(const std::string& text, const std::string& todo) {
    const Finished done = commission();
    EXPECT_EQ(done.code, 2) << done.output;
    EXPECT_THAT(done.output, HasSubstr(text));
    EXPECT_THAT(done.output, HasSubstr(todo));
    EXPECT_THAT(done.output, HasSubstr("goes on where it was"));
    EXPECT_TRUE(fs::exists(folder_ / "site/commission/report.html"));
  }

  TempFolder folder_;
  std::string domain_ = next_domain();
  std::optional<Process> crane_;
  std::optional<Meddler> meddler_;
  SiteConfig site_;
  std::map<std::string, std::string> answers_;
};

/// What 'check' found changed, line by line.
std::vector<std::string> changes(const std::string& output) {
  std::vector<std::string> out;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("CHANGED")) out.push_back(line);
  return out;
}

TEST_F(Commission, FromAnEmptyFolderToAValidMapThroughAllMistakes) {
  // The wrong serial port; corrected in the configuration, begun anew.
  const std::string port = site_.rangefinders[0].port;
  site_.rangefinders[0].port = "/dev/ttyNONE";
  expect_failure("/dev/ttyNONE", "->");
  fs::remove(folder_ / "site/site.yaml");
  site_.rangefinders[0].port = port;
  // Told that the laser of the bridge stands at the far end, which it does not.
  site_.mapper.cart_direction = -1;

  meddler_->mode = Meddler::kCapRight;
  expect_failure("the right image is black", "take the cap off the right lens");
  meddler_->mode = Meddler::kLightOff;
  expect_failure("both images are black", "switch the light on");
  meddler_->mode = Meddler::kSwapped;
  expect_failure("swapped", "swap the two cables");
  meddler_->mode = Meddler::kFine;

  answers_["board"] = "chessboard:10x7:0.02";
  expect_failure("is in none of the images", "9x6");
  answers_["board"] = "chessboard:9x6:0.022";
  expect_failure("measure the board's squares again", "20.0");
  EXPECT_FALSE(fs::exists(folder_ / "site/rig.yaml"));
  answers_["board"] = "chessboard:9x6:0.02";
  answers_["drive_s"] = "1";
  expect_failure("too short", "drive the bridge over");

  answers_["drive_s"] = "16";
  Finished done = commission();
  EXPECT_THAT(done.output, HasSubstr("direction is another than was told"));
  // A busy machine renders few frames and answers late, which is said; a technician drives longer.
  answers_["drive_s"] = "30";
  for (int more = 0; more < 2 && done.code == 2; ++more) done = commission();
  EXPECT_EQ(done.code, 0) << done.output;
  const auto rig = read_rig(folder_ / "site");
  ASSERT_TRUE(rig.ok()) << done.output;
  EXPECT_NEAR(rig.value().camera_height_m(), 1.95, 0.02);
  const auto site = read_site_config(folder_ / "site/site.yaml");
  ASSERT_TRUE(site.ok()) << site.error().text();
  EXPECT_EQ(site.value().mapper.cart_direction, 1) << done.output;
  EXPECT_EQ(site.value().camera.path, site_.camera.path);
  std::ifstream file(folder_ / "site/site.yaml");
  std::string first;
  std::getline(file, first);
  EXPECT_EQ(first, "# The hall's keeper: tel. 4711");
  // As systemd's units look for it.
  EXPECT_TRUE(fs::exists(folder_ / "site/calibration/cam1/sensor.yaml"));
  EXPECT_TRUE(fs::exists(folder_ / "site/commission/map/map_view.png"));
  // Nothing is left to do.
  const Finished again = commission();
  EXPECT_EQ(again.code, 0) << again.output;
  EXPECT_THAT(again.output, ::testing::Not(HasSubstr("==")));

  // In service, later: nothing has changed; then somebody knocks against the camera; then nothing
  // runs any more.
  const std::vector<std::string> check = {"check", "--site", folder_ / "site", "--for", "16s"};
  {
    Process services({"cranemap", "serve", "--site", folder_ / "site", "camera", "rangefinder",
                      "stereo", "mapper", "--state", folder_ / "state"},
                     folder_ / "services.txt");
    const Finished same = run(check, folder_.path(), 100);
    // Under load an emulated rangefinder really answers later, and is said to.
    EXPECT_THAT(changes(same.output), ::testing::Each(HasSubstr("come late by"))) << same.output;
    EXPECT_EQ(same.code, changes(same.output).empty() ? 0 : 1) << same.output << services.output();
    EXPECT_THAT(same.output, HasSubstr("camera above the floor"));
    meddler_->mode = Meddler::kBumped;
    const Finished bumped = run(check, folder_.path(), 100);
    EXPECT_EQ(bumped.code, 1) << bumped.output;
    EXPECT_THAT(changes(bumped.output),
                ::testing::Contains(HasSubstr("the camera has turned: look for loose bolts")))
        << bumped.output;
    services.signal(SIGTERM);
    EXPECT_EQ(services.wait(20), 0) << services.output();
  }
  const Finished nothing =
      run({"check", "--site", folder_ / "site", "--for", "3s"}, folder_.path(), 60);
  EXPECT_NE(nothing.code, 0) << nothing.output;
  EXPECT_THAT(nothing.output, HasSubstr("cranemap doctor"));
  for (const auto& left : fs::directory_iterator(fs::temp_directory_path()))
    EXPECT_THAT(left.path().filename().string(),
                ::testing::Not(::testing::StartsWith("cranemap-check-")));
}

TEST_F(Commission, SaysWhichAnswerIsMissingAndIsBrokenOffAndGoneOnWith) {
  answers_.erase("camera_height_m");
  const Finished missing = commission();
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.output, HasSubstr("camera_height_m"));
  EXPECT_THAT(missing.output, HasSubstr("PASSED    Images"));
  answers_["camera_heigth_m"] = "2";
  EXPECT_THAT(commission().output, HasSubstr("'camera_height_m' is meant?"));
  answers_.erase("camera_heigth_m");
  answers_["camera_height_m"] = "1,95";
  EXPECT_THAT(commission().output, HasSubstr("decimal point"));
  std::ofstream(folder_ / "site/commission/book.json") << "{\"items\": [{}]}";
  EXPECT_THAT(commission().output, HasSubstr("book.json: is damaged"));
}

TEST(SeveralCranes, TwoOnOneHostHaveTheirOwnPortsStatesAndMaps) {
  const TempFolder folder;
  const std::string domain = next_domain();
  const int port = 20'000 + getpid() % 20'000;
  std::list<Process> processes;
  for (const int crane : {1, 2}) {
    const std::string site = folder / ("crane-" + std::to_string(crane));
    processes.emplace_back(
        std::vector<std::string>{"cranemap", "emulate-crane", rig_recording(), "--out", site,
                                 "--domain", domain, "--crane", std::to_string(crane)},
        site + ".txt");
    ASSERT_TRUE(eventually(20s, [&] { return fs::exists(site + "/trolley"); }));
    auto config = read_site_config(site + "/site.yaml");
    ASSERT_TRUE(config.ok());
    config.value().http.port = port + 20 * (crane - 1);
    std::ofstream(site + "/site.yaml") << to_yaml(config.value());
    processes.emplace_back(std::vector<std::string>{"cranemap", "serve", "--site", site, "--state",
                                                    folder / ("state-" + std::to_string(crane))},
                           site + "-serve.txt");
  }
  std::set<std::uint64_t> maps;
  for (const std::uint32_t crane : {1U, 2U}) {
    client::Options options;
    options.domain = static_cast<std::uint32_t>(std::stoi(domain));
    options.crane = crane;
    std::string error;
    const auto map = client::Map::join(options, error);
    ASSERT_NE(map, nullptr) << error;
    EXPECT_TRUE(eventually(60s, [&] { return map->status().frames_integrated >= 2; }))
        << crane << processes.back().output();
    maps.insert(map->status().map_id);
  }
  EXPECT_EQ(maps.size(), 2U);
  // What the one dashboard of both asks for: each crane at its own port, under its own label.
  constexpr int kMapper = 4;
  for (const int crane : {1, 2}) {
    const std::string valid = "cranemap_map_valid{crane=\"" + std::to_string(crane) + "\"";
    std::string page;
    EXPECT_TRUE(eventually(20s, [&] {
      const auto got = http::get("127.0.0.1", port + 20 * (crane - 1) + kMapper, "/metrics");
      if (got) page = got->body;
      return page.find(valid) != std::string::npos;
    })) << page;
    EXPECT_THAT(page, ::testing::Not(HasSubstr("crane=\"" + std::to_string(3 - crane) + "\"")));
  }
  for (Process& process : processes)
    EXPECT_THAT(process.output(), ::testing::Not(HasSubstr("starts again"))) << "all have a port";
  // A third one that was given the ports of the first.
  std::ofstream(folder / "third.yaml") << "crane: 3\nhttp: {port: " << port << "}\n";
  std::ofstream(folder / "none.yaml") << "zones_right: yes\n";
  const Finished third = run({"commission", "--out", folder / "third", "--config",
                              folder / "third.yaml", "--answers", folder / "none.yaml"},
                             folder.path());
  EXPECT_THAT(third.output, HasSubstr("give this one its own, http: {port: "));
  for (Process& process : processes) process.signal(SIGTERM);
  for (Process& process : processes) EXPECT_EQ(process.wait(20), 0) << process.output();
}

}  // namespace
}  // namespace crane::test
