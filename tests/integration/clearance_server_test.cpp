// SPDX-License-Identifier: Apache-2.0
// A controller without our library: requests and replies over DDS, beside a mapper.

#include "clearance/clearance_server.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "bounds.h"
#include "domain.hpp"
#include "mapper/heartbeat.hpp"
#include "mapper/map_publisher.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

class ClearanceServerTest : public ::testing::Test {
 protected:
  ClearanceServerTest()
      : rig_(Recording::open(test::rig_recording())->rig()),
        builder_(config(), rig_),
        participant_(*dds::Participant::create(test::settings(), "mapper")),
        publisher_(*MapPublisher::create(participant_, {1, 42, 7}, false)),
        heartbeat_(*Heartbeat::create(participant_, {1, 42, 7})),
        controller_(*dds::Participant::create(test::settings(), "controller")),
        requests_(*dds::Writer<dds::ClearanceRequestTopic>::create(controller_)),
        replies_(*dds::Reader<dds::ClearanceReplyTopic>::create(controller_, &wakeup_)) {
    client::Options options;
    options.domain = test::settings().domain;
    std::string error;
    auto map = client::Map::join(options, error);
    EXPECT_NE(map, nullptr) << error;
    server_.emplace(*ClearanceServer::create(participant_, std::move(map)));
    serving_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) EXPECT_TRUE(server_->step(20ms));
    });
  }

  static MapperConfig config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    return c;
  }
  /// 1.6 m x 1.6 m of floor with 1.5 m of free space above, and a thing of some height on it.
  void make_map(double thing_m) {
    OccupancyMap& map = builder_.map();
    Tile& tile = map.tile({0, 0});
    Block& block = *map.block(tile, 0);
    for (int i = 0; i < kBlockVoxels; ++i) {
      const int x = i % 32, y = i / 32 % 32, z = i / kTileColumns;
      const bool thing = x >= 20 && x < 24 && y >= 10 && y < 20 && (z + 0.5) * 0.05 < thing_m;
      block.log_odds[std::size_t(i)] = z == 0 || thing ? 60 : z < 30 ? -40 : 0;
    }
    for (Column& column : tile.columns) column.last_observed = SystemClock().now();
    tile.reclassified = true;
    map.mark_changed(tile);
    EXPECT_TRUE(publisher_.publish_tiles(builder_, true));
    heartbeat_->say(publisher_.status(builder_, {}));
  }
  static v1::ClearanceRequest request(std::uint64_t number, double z_m) {
    v1::ClearanceRequest r;
    r.crane(1);
    r.client(77);
    r.sequence_number(number);
    r.time_ns(SystemClock().now());
    r.load_size_x_m(0.2);
    r.load_size_y_m(0.2);
    r.load_size_z_m(0.2);
    r.margin_horizontal_m(0.05);
    r.margin_vertical_m(0.1);
    for (const double x : {0.3, 1.3}) {
      v1::ClearancePose pose;
      pose.x_m(x);
      pose.y_m(0.8);
      pose.z_m(z_m);
      r.path().push_back(pose);
    }
    return r;
  }
  /// Asks until the answer is one that is waited for; heartbeats go on meanwhile.
  v1::ClearanceReply ask_until(double z_m,
                               const std::function<bool(const v1::ClearanceReply&)>& is) {
    v1::ClearanceReply last;
    const std::uint64_t before = number_;  // a reply may come a round later
    (void)test::eventually([&] {
      heartbeat_->say(publisher_.status(builder_, {}));
      EXPECT_TRUE(requests_.write(request(++number_, z_m)));
      wakeup_.wait_for(50ms);
      while (const auto reply = replies_.take())
        if ((**reply).client() == 77 && (**reply).sequence_number() > before) last = **reply;
      return is(last);
    });
    return last;
  }

  StereoRig rig_;
  MappingPipeline builder_;
  std::shared_ptr<dds::Participant> participant_;
  MapPublisher publisher_;
  std::unique_ptr<Heartbeat> heartbeat_;
  Wakeup wakeup_;
  std::shared_ptr<dds::Participant> controller_;
  dds::Writer<dds::ClearanceRequestTopic> requests_;
  dds::Reader<dds::ClearanceReplyTopic> replies_;
  std::uint64_t number_ = 0;
  std::optional<ClearanceServer> server_;
  std::jthread serving_;
};

TEST_F(ClearanceServerTest, AnswersClearBlockedAndWhereItIsSafe) {
  make_map(0);
  const auto clear = ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  ASSERT_EQ(clear.verdict(), v1::VERDICT_CLEAR) << clear.text().c_str();
  EXPECT_EQ(clear.map_id(), 42U);
  EXPECT_EQ(clear.unknown_fraction(), 0);
  EXPECT_GE(clear.oldest_age_s(), 0);
  EXPECT_LT(clear.oldest_age_s(), 60);
  make_map(0.6);
  // A tile may be there a moment before the heartbeat of its revision.
  const auto blocked = ask_until(0.5, [&clear](const auto& r) {
    return r.verdict() == v1::VERDICT_BLOCKED && r.revision() > clear.revision();
  });
  ASSERT_EQ(blocked.verdict(), v1::VERDICT_BLOCKED);
  EXPECT_EQ(blocked.reason(), v1::CLEARANCE_OBSTACLE);
  EXPECT_NEAR(blocked.first_x_m(), 1.025, 1e-9);
  EXPECT_EQ(blocked.has_safe_height(), 1U);
  EXPECT_NEAR(blocked.safe_height_m(), 0.7, 1e-9);
  EXPECT_NEAR(blocked.safe_low_m(), 0.7, 1e-9);
  EXPECT_NEAR(blocked.safe_high_m(), 1.2, 1e-9);
  const auto too_high = ask_until(
      3, [](const auto& r) { return r.verdict() == v1::VERDICT_BLOCKED && r.first_z_m() > 2; });
  EXPECT_EQ(too_high.has_safe_height(), 0U) << "no advice to come down";
  const auto above = ask_until(blocked.safe_height_m(),
                               [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  EXPECT_EQ(above.verdict(), v1::VERDICT_CLEAR) << above.text().c_str();
}

TEST_F(ClearanceServerTest, OfAFloodOfRequestsAFewAreAnsweredAStepAndAllInTheEnd) {
  make_map(0);
  (void)ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  serving_ = {};  // from here on this thread steps
  constexpr std::uint64_t kFlood = 40;
  const std::uint64_t before = server_->counts().received;
  for (std::uint64_t i = 0; i < kFlood; ++i) ASSERT_TRUE(requests_.write(request(5000 + i, 0.5)));
  std::uint64_t answered = server_->answered(), most = 0;
  EXPECT_TRUE(test::eventually([&] {
    EXPECT_TRUE(server_->step(20ms));
    most = std::max(most, server_->answered() - answered);
    answered = server_->answered();
    return server_->counts().received >= before + kFlood;
  }));
  EXPECT_GE(most, 1U);
  EXPECT_LE(most, 4U);
}

TEST_F(ClearanceServerTest, WhoAsksWithoutEndWaitsBehindItselfAndNobodyElseDoes) {
  make_map(0);
  (void)ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  serving_ = {};  // from here on this thread steps
  auto flooder = *dds::Participant::create(test::settings(), "flooder");
  auto flood = *dds::Writer<dds::ClearanceRequestTopic>::create(flooder);
  ASSERT_TRUE(test::eventually([&] { return flood.matched() > 0; }));
  const auto count = [&] { return server_->counts().received; };
  // More than may wait, taken in steps that answer a few each.
  std::uint64_t before = count();
  for (std::uint64_t i = 0; i < 300; ++i) {
    auto r = request(9000 + i, 0.5);
    r.client(78);  // whatever it says: it is told apart by who DDS says it is
    ASSERT_TRUE(flood.write(r));
    if (i % 60 == 59)
      ASSERT_TRUE(test::eventually([&] {
        EXPECT_TRUE(server_->step(0ms));
        return count() >= before + i - 5;
      }));
  }
  EXPECT_GT(server_->dropped.of(Cause::kTooManyRequests), 100U);
  before = count();
  heartbeat_->say(publisher_.status(builder_, {}));
  ASSERT_TRUE(requests_.write(request(++number_, 0.5)));
  ASSERT_TRUE(test::eventually([&] {
    if (count() == before) EXPECT_TRUE(server_->step(0ms));
    return count() > before;
  }));
  // It was taken; some sixty of the other's wait. Two steps are its turn at the latest.
  EXPECT_TRUE(server_->step(0ms));
  EXPECT_TRUE(server_->step(0ms));
  bool answered = false;
  EXPECT_TRUE(test::eventually([&] {
    while (const auto reply = replies_.take())
      answered = answered || ((**reply).client() == 77 && (**reply).sequence_number() == number_);
    return answered;
  }));
}

TEST_F(ClearanceServerTest, ARequestThatWouldCostTooMuchIsRefusedWithTheReason) {
  make_map(0);
  (void)ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  auto costly = request(7000, 0.5);
  costly.path()[1] = costly.path()[0];
  costly.path()[1].z_m(1000);
  costly.load_size_x_m(100);
  costly.load_size_y_m(100);
  EXPECT_TRUE(requests_.write(costly));
  v1::ClearanceReply reply;
  EXPECT_TRUE(test::eventually([&] {
    wakeup_.wait_for(10ms);
    while (const auto taken = replies_.take()) reply = **taken;
    return reply.sequence_number() == 7000;
  }));
  EXPECT_EQ(reply.verdict(), v1::VERDICT_INVALID);
  EXPECT_EQ(reply.reason(), v1::CLEARANCE_BAD_QUERY);
  EXPECT_NE(std::string(reply.text().c_str()).find("four million"), std::string::npos);
}

TEST_F(ClearanceServerTest, WithoutAHeartbeatThereIsNoVerdict) {
  EXPECT_TRUE(test::eventually(
      [this] { return requests_.matched() > 0 && server_->map().status().tiles == 0; }));
  EXPECT_TRUE(requests_.write(request(++number_, 0.5)));
  v1::ClearanceReply reply;
  EXPECT_TRUE(test::eventually([&] {
    wakeup_.wait_for(10ms);
    while (const auto taken = replies_.take()) reply = **taken;
    return reply.sequence_number() == number_;
  }));
  EXPECT_EQ(reply.verdict(), v1::VERDICT_INVALID);
  EXPECT_EQ(reply.reason(), v1::CLEARANCE_MAP_INVALID);
  EXPECT_STREQ(reply.text().c_str(), "no mapper heard yet");
}

TEST_F(ClearanceServerTest, AnswersASenselessRequestAndGoesOn) {
  make_map(0);
  auto bad = request(1000, 0.5);
  bad.load_size_x_m(-3);
  (void)ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  EXPECT_TRUE(requests_.write(bad));
  v1::ClearanceReply reply;
  EXPECT_TRUE(test::eventually([&] {
    wakeup_.wait_for(10ms);
    while (const auto taken = replies_.take()) reply = **taken;
    return reply.sequence_number() == 1000;
  }));
  EXPECT_EQ(reply.verdict(), v1::VERDICT_INVALID);
  auto not_finite = request(1001, 0.5);
  not_finite.path()[0].x_m(std::nan(""));
  EXPECT_TRUE(requests_.write(not_finite));  // refused by the reader, and counted
  EXPECT_TRUE(test::eventually([this] { return server_->counts().invalid > 0; }));
  const auto again = ask_until(0.5, [](const auto& r) { return r.verdict() == v1::VERDICT_CLEAR; });
  EXPECT_EQ(again.verdict(), v1::VERDICT_CLEAR);
}

}  // namespace
}  // namespace crane
