// SPDX-License-Identifier: Apache-2.0
// A whole crane without hardware: rendered pictures and emulated rangefinders, through the real
// drivers, services and DDS, into a map that is judged by the scene's truth.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "crane/client/map.hpp"
#include "http/client.hpp"
#include "process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const std::string kScene = CRANEMAP_SOURCE_DIR "/tests/data/live_scene.yaml";

TEST(LiveCrane, TheDemoMapsASceneThroughTheRealDriversAsExactlyAsARecording) {
  const TempFolder folder;
  const std::string out = folder / "out";
  // A busy machine renders fewer pairs in the same time and may not ask its devices often enough to
  // place all of them; what is in the map is to be right.
  const Finished demo = run({"demo", "--live", "--scene", kScene, "--out", out, "--live-rate", "2",
                             "--live-speed", "0.2", "--domain", next_domain()},
                            folder.path(), 150);
  const bool all = demo.output.find("of the camera are not in the map") == std::string::npos;
  ASSERT_EQ(demo.code, all ? 0 : 4) << demo.output;
  std::ifstream file(out + "/report.json");
  const auto report = nlohmann::json::parse(file);
  EXPECT_GE(report["frames"]["integrated"], 4) << demo.output;
  EXPECT_TRUE(report["map"]["complete_at_subscriber"]);
  const auto& judged = report["judgement"];
  EXPECT_EQ(judged["unsafe"], 0) << judged;
  EXPECT_EQ(judged["missed"], 0) << judged;
  EXPECT_LE(judged["phantom"], 0.001) << judged;
  EXPECT_EQ(judged["clearance"]["wrong_clear"], 0) << judged;
  EXPECT_GT(judged["clearance"]["clear"], 0) << judged;
  for (const auto& height : report["heights"])
    if (height["columns"] > 0) EXPECT_LE(height["error_percent"], 2) << height;
  EXPECT_FALSE(fs::exists(out + "/state")) << "what the emulated crane needed is gone";
}

TEST(LiveCrane, ARecordingsCraneIsThereForWhoeverServesItsSite) {
  const TempFolder folder;
  const std::string domain = next_domain();
  Process crane(
      {"cranemap", "emulate-crane", rig_recording(), "--out", folder / "crane", "--domain", domain},
      folder / "crane.txt");
  ASSERT_TRUE(eventually(20s, [&] { return fs::exists(folder / "crane/trolley"); }))
      << crane.output();
  Process serve({"cranemap", "serve", "--site", folder / "crane"}, folder / "serve.txt");
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  EXPECT_TRUE(eventually(60s, [&] { return map->status().frames_integrated >= 3; }))
      << serve.output() << crane.output();
  EXPECT_TRUE(crane.running()) << "round and round";
  for (Process* process : {&serve, &crane}) {
    process->signal(SIGTERM);
    EXPECT_EQ(process->wait(20), 0) << process->output();
  }
}

TEST(LiveCrane, SaysWhatCannotBeEmulated) {
  const TempFolder folder;
  const auto emulate = [&](const std::string& from, const std::string& out) {
    return run({"emulate-crane", from, "--out", out, "--for", "1"}, folder.path(), 30);
  };
  const Finished nothing = emulate("/no/such/scene", folder / "a");
  EXPECT_EQ(nothing.code, 2) << nothing.output;
  EXPECT_FALSE(fs::exists(folder / "a"));
  fs::create_directories(folder / "mine");
  std::ofstream(folder / "mine/x") << "x";
  const Finished taken = emulate(rig_recording(), folder / "mine");
  EXPECT_EQ(taken.code, 2);
  EXPECT_NE(taken.output.find("nothing was changed"), std::string::npos) << taken.output;
}

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  EXPECT_EQ(bind(socket, reinterpret_cast<sockaddr*>(&at), size), 0);
  EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size), 0);
  close(socket);
  return ntohs(at.sin_port);
}

TEST(LiveCrane, TheDemoStaysOnThePageWhereALoadIsCarriedUntilItIsStopped) {
  const TempFolder folder;
  const int port = free_port();
  std::ofstream(folder / "site.yaml") << "http: {port: 0}\ngateway: {port: " << port << "}\n";
  Process demo(
      {"cranemap", "demo", "--recording", rig_recording(), "--rate", "max", "--out", folder / "out",
       "--config", folder / "site.yaml", "--domain", next_domain(), "--page"},
      folder / "demo.txt");
  const std::string url = "http://localhost:" + std::to_string(port) + "/";
  ASSERT_TRUE(eventually(120s, [&] { return demo.output().find(url) != std::string::npos; }))
      << demo.output();
  bool carried = false;
  nlohmann::json state;
  EXPECT_TRUE(eventually(
      120s,
      [&] {
        const auto answer = http::get("127.0.0.1", port, "/api/v1/status");
        state = nlohmann::json::parse(answer ? answer->body : "", nullptr, false);
        if (!state.is_object() || !state["hoist"].is_object()) return false;
        carried = carried || state["hoist"]["load_size_m"][2] > 0;
        return carried && state["map"]["valid"] == true && state["map"]["frames"]["integrated"] > 3;
      }))
      << state << demo.output();
  demo.signal(SIGINT);
  EXPECT_EQ(demo.wait(60), 0) << demo.output();
  EXPECT_FALSE(http::get("127.0.0.1", port, "/api/v1/status")) << "its services are gone with it";
}

}  // namespace
}  // namespace crane::test
