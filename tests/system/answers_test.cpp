// SPDX-License-Identifier: Apache-2.0
// What a controller is told of the demo's map, asked as README says.

#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <regex>
#include <sstream>
#include <thread>

#include "base/clock.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

/// `cranemap serve` with the demo's recording, played round and round in real time.
class Demo {
 public:
  explicit Demo(const std::string& more_config = "") {
    std::ofstream(folder_ / "site.yaml")
        << "dds: {domain: " << domain_ << "}\nmapper: {voxel_m: 0.02}\nhttp: {port: 0}\n"
        << more_config;
    serve_.emplace(
        std::vector<std::string>{"cranemap", "serve", "--config", config(), "--recording",
                                 rig_recording(), "mapper", "stereo", "rangefinder", "camera"},
        folder_ / "serve.txt");
    client::Options options;
    options.domain = domain();
    std::string error;
    map_ = client::Map::join(options, error);
    EXPECT_NE(map_, nullptr) << error;
  }
  ~Demo() {
    serve_->signal(SIGTERM);
    EXPECT_EQ(serve_->wait(20), 0);
  }
  /// All six positions have been seen, and again.
  [[nodiscard]] bool seen() const {
    return eventually(60s, [this] {
      const client::Status s = map_->status();
      return s.valid && s.complete && s.frames_integrated >= 13;
    });
  }
  [[nodiscard]] std::string config() const { return folder_ / "site.yaml"; }
  [[nodiscard]] std::uint32_t domain() const {
    return static_cast<std::uint32_t>(std::stoi(domain_));
  }
  [[nodiscard]] const client::Map& map() const { return *map_; }
  [[nodiscard]] const TempFolder& folder() const { return folder_; }
  [[nodiscard]] std::string output() const { return serve_->output(); }

 private:
  TempFolder folder_;
  std::string domain_ = next_domain();
  std::optional<Process> serve_;
  std::unique_ptr<client::Map> map_;
};

std::string readme() {
  std::ifstream file(CRANEMAP_SOURCE_DIR "/README.md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<double> numbers(const std::string& text, const std::regex& in) {
  std::smatch found;
  std::vector<double> out;
  if (!std::regex_search(text, found, in)) return out;
  static const std::regex kNumber(R"(-?[0-9]+(\.[0-9]+)?)");
  const std::string part = found[1];
  for (std::sregex_iterator it(part.begin(), part.end(), kNumber), end; it != end; ++it)
    out.push_back(std::stod(it->str()));
  return out;
}

TEST(Answers, TheReadmesQueryAndSnippetAreClearOnTheDemosMapAndWhatTheySawWasSeenJustNow) {
  const Demo demo;
  ASSERT_TRUE(demo.seen()) << demo.map().status().reason << "\n" << demo.output();
  const std::string text = readme();
  std::smatch line;
  ASSERT_TRUE(std::regex_search(text, line, std::regex(R"((?:^|\n)cranemap (query [^#\n]+))")));
  std::istringstream words(line[1].str());
  std::vector<std::string> command;
  for (std::string word; words >> word;) command.push_back(word);
  command.insert(command.end(), {"--config", demo.config()});
  const Finished asked = run(command, demo.folder().path());
  EXPECT_EQ(asked.code, 0) << asked.output;
  EXPECT_EQ(asked.output.rfind("CLEAR", 0), 0U) << asked.output;

  client::ClearanceQuery query;
  const auto path = numbers(text, std::regex(R"(query\.path = \{(.*)\};)"));
  ASSERT_EQ(path.size(), 8U);
  for (std::size_t i = 0; i < path.size(); i += 4)
    query.path.push_back({path[i], path[i + 1], path[i + 2], path[i + 3]});
  const auto load = numbers(text, std::regex(R"(query\.load = \{(.*)\};)"));
  ASSERT_EQ(load.size(), 4U);
  query.load = {load[0], load[1], load[2], load[3]};
  const auto margins = numbers(text, std::regex(R"(query\.margins = \{(.*)\};)"));
  ASSERT_EQ(margins.size(), 4U);
  query.margins = {margins[0], margins[1], margins[2], margins[3]};
  const client::Clearance c = demo.map().clearance(query);
  EXPECT_EQ(c.verdict, client::Verdict::kClear) << c.text;
  EXPECT_GE(c.oldest_age_s, 0);
  EXPECT_LT(c.oldest_age_s, 120) << "not the age of the recording";
  query.max_age_s = 120;
  EXPECT_EQ(demo.map().clearance(query).verdict, client::Verdict::kClear);

  for (client::Pose& p : query.path) p.z_m = 9;  // far above what any camera of this rig saw
  const client::Clearance high = demo.map().clearance(query);
  EXPECT_EQ(high.verdict, client::Verdict::kBlocked);
  EXPECT_TRUE(std::isnan(high.safe_height_m)) << "nobody is told to come down";
  query.load.above_m = client::kToRopeTop;
  for (client::Pose& p : query.path) p.z_m = path[2];
  const client::Clearance rope = demo.map().clearance(query);
  EXPECT_EQ(rope.reason, client::Reason::kUnknown) << "no camera saw the space right below it";
  EXPECT_NE(rope.text.find("above the load"), std::string::npos) << rope.text;
}

TEST(Answers, AControllersOwnHoistStateOfNowAgreesWithTheDemo) {
  const Demo demo("hoist: {enabled: true}\n");
  ASSERT_TRUE(eventually(60s, [&] {
    return demo.map().status().hoist == client::Status::Hoist::kLost &&
           demo.map().status().last_frame_time_ns > 0;
  })) << demo.output();
  dds::Settings settings;
  settings.domain = demo.domain();
  auto participant = *dds::Participant::create(settings, "controller");
  auto writer = *dds::Writer<dds::HoistStateTopic>::create(participant);
  v1::HoistState state;
  state.crane(1);
  state.hook_height_m(1.8);
  EXPECT_TRUE(eventually(30s, [&] {
    state.time_ns(SystemClock().now());
    state.sequence_number(state.sequence_number() + 1);
    EXPECT_TRUE(writer.write(state));
    std::this_thread::sleep_for(50ms);
    return demo.map().status().hoist == client::Status::Hoist::kKnown;
  })) << demo.map().status().reason;
}

}  // namespace
}  // namespace crane::test
