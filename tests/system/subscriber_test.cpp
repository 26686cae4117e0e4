// SPDX-License-Identifier: Apache-2.0
// Subscribers of a living map: many, stopped for a while, and over the death of the mapper.

#include <gtest/gtest.h>
#include <signal.h>

#include <thread>

#include "crane/client/map.hpp"
#include "system/live_services.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

std::unique_ptr<client::Map> join(const std::string& domain) {
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  auto map = client::Map::join(options, error);
  EXPECT_NE(map, nullptr) << error;
  return map;
}

void stop(std::list<Process>& services) {
  for (Process& service : services) service.signal(SIGTERM);
  for (Process& service : services) EXPECT_EQ(service.wait(10), 0) << service.output();
}

/// No more frames: the map then stands still.
void stop_camera(std::list<Process>& services) {
  services.back().signal(SIGTERM);
  EXPECT_EQ(services.back().wait(10), 0);
  services.pop_back();
  std::this_thread::sleep_for(2500ms);
}

TEST(Subscribers, TwentyAtOnceHoldTheSameMap) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain, "3");
  std::vector<std::unique_ptr<client::Map>> maps;
  for (int i = 0; i < 20; ++i) {  // some early, some in the middle
    maps.push_back(join(domain));
    ASSERT_NE(maps.back(), nullptr);
    std::this_thread::sleep_for(200ms);
  }
  std::this_thread::sleep_for(2s);
  stop_camera(services);
  for (const auto& map : maps) EXPECT_TRUE(map->wait_until_complete(10s)) << map->status().reason;
  const client::Status first = maps.front()->status();
  EXPECT_GT(first.tiles, 5U);
  EXPECT_GT(first.frames_integrated, 10U);
  EXPECT_EQ(first.frames_missing, 0U) << "subscribers do not hold up the map";
  for (const auto& map : maps) {
    const client::Status s = map->status();
    EXPECT_EQ(s.revision, first.revision);
    EXPECT_EQ(s.voxel_digest, first.voxel_digest);
    EXPECT_EQ(s.height_digest, first.height_digest);
  }
  stop(services);
}

TEST(Subscribers, OneThatWasStoppedForTenSecondsCatchesUpAndHoldsNobodyUp) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain, "3");
  const auto other = join(domain);
  Process stopped({"cranemap", "watch", "--domain", domain, "--seconds", "24"},
                  folder / "watch.txt");
  std::this_thread::sleep_for(3s);
  const auto before = other->status().frames_integrated;
  stopped.signal(SIGSTOP);
  std::this_thread::sleep_for(10s);
  const auto after = other->status().frames_integrated;
  EXPECT_GT(after, before + 15) << "the map went on meanwhile";
  EXPECT_EQ(other->status().frames_missing, 0U);
  stopped.signal(SIGCONT);
  std::this_thread::sleep_for(1s);
  stop_camera(services);
  ASSERT_TRUE(other->wait_until_complete(10s));
  EXPECT_EQ(stopped.wait(30), 0);
  const std::string said = stopped.output();
  const std::string last = said.substr(said.rfind("map    "));
  EXPECT_NE(last.find("complete here"), std::string::npos) << last;
  EXPECT_NE(last.find("revision " + std::to_string(other->status().revision) + " "),
            std::string::npos)
      << last << other->status().revision;
  stop(services);
}

TEST(Subscribers, SayInvalidWhenTheMapperIsKilledAndFollowTheNextMapWhichKeepsItsContent) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain, "5", true);
  const auto map = join(domain);
  ASSERT_TRUE(eventually(20s, [&] { return map->status().frames_integrated > 20; }));
  const client::Status before = map->status();
  ASSERT_TRUE(before.valid);
  kill(services.front().pid(), SIGKILL);
  const auto killed = Steady::now();
  ASSERT_TRUE(eventually(5s, [&] { return !map->status().valid; }));
  const double noticed_s = std::chrono::duration<double>(Steady::now() - killed).count();
  EXPECT_LT(noticed_s, 1.3) << "the heartbeat's deadline is a second";
  client::ClearanceQuery query;
  query.path = {{1, 1, 1, 0}};
  EXPECT_EQ(map->clearance(query).verdict, client::Verdict::kInvalid);
  EXPECT_EQ(services.front().wait(5), 128 + SIGKILL);
  services.pop_front();
  services.emplace_front(
      std::vector<std::string>{"cranemap-mapper", "--config", folder / "site.yaml", "--calibration",
                               rig_recording(), "--state", folder / "state"},
      folder / "mapper2.txt");
  ASSERT_TRUE(eventually(15s, [&] { return map->status().map_id != before.map_id; }))
      << services.front().output();
  ASSERT_TRUE(map->wait_until_complete(10s)) << map->status().reason;
  const client::Status after = map->status();
  EXPECT_TRUE(eventually(5s, [&] { return map->status().valid; })) << map->status().reason;
  EXPECT_GE(after.tiles, before.tiles);
  // At 5 frames a second: at most one second of integration is lost.
  EXPECT_GE(after.frames_integrated + 5, before.frames_integrated);
  EXPECT_NE(services.front().output().find("goes on with saved map"), std::string::npos);
  stop(services);
}

}  // namespace
}  // namespace crane::test
