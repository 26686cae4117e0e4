// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bounds.h"
#include "service/health.hpp"
#include "service/metrics.hpp"
#include "service/play_clock.hpp"
#include "service/stream_gate.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

class StreamGateTest : public ::testing::Test {
 protected:
  static constexpr dds::ParticipantId kA = {1}, kB = {2};
  bool pass(std::uint64_t stream, const dds::ParticipantId& writer, int ms) {
    return gate_.pass(
        stream, writer, [this](const dds::ParticipantId&) { return gone_; },
        t0_ + std::chrono::milliseconds(ms));
  }
  StreamGate gate_;
  StreamGate::Clock::time_point t0_ = StreamGate::Clock::now();
  bool gone_ = false;
};

TEST_F(StreamGateTest, LetsASecondSourceThroughOnlyOnceTheFirstIsSilent) {
  EXPECT_TRUE(pass(1, kA, 0));
  EXPECT_FALSE(pass(2, kB, 100));
  EXPECT_TRUE(pass(1, kA, 2000));
  EXPECT_FALSE(pass(2, kB, 4900));
  EXPECT_TRUE(pass(2, kB, 5001)) << "3 s after the last of the first";
  EXPECT_FALSE(pass(1, kA, 6000));
}

TEST_F(StreamGateTest, ADeviceThatItsProcessConnectsAnewGoesOnAtOnceAndTwoInTurnDoNot) {
  EXPECT_TRUE(pass(1, kA, 0));
  EXPECT_TRUE(pass(2, kA, 100));
  EXPECT_FALSE(pass(1, kA, 200)) << "back again: two devices";
  EXPECT_FALSE(pass(3, kB, 300)) << "another process still has to wait";
  EXPECT_TRUE(pass(4, kA, 400));
}

TEST_F(StreamGateTest, AnotherProcessGoesOnAtOnceWhereTheFirstIsGone) {
  EXPECT_TRUE(pass(1, kA, 0));
  gone_ = true;
  EXPECT_TRUE(pass(2, kB, 100));
  gone_ = false;
  EXPECT_FALSE(pass(1, kA, 200));
  EXPECT_TRUE(pass(2, kB, 300));
}

TEST(StampOffset, IsOneNumberForAllPlayersOfAPlayAndNeverAheadOfTheClock) {
  constexpr TimeNs kFrom = 1'700'000'000 * kNsPerSecond, kTo = kFrom + 100 * kNsPerSecond;
  constexpr TimeNs kStart = 1'800'000'000 * kNsPerSecond;
  for (const double factor : {0.25, 1.0, 2.0, 10.0}) {
    const StampOffset offset = stamp_offset(Stamps::kNow, {factor}, false, kFrom, kTo, kStart);
    EXPECT_EQ(offset.why_recorded, nullptr);
    const PlayClock clock({factor}, kFrom, kStart);
    double nearest_s = 1e9;
    for (TimeNs recorded = kFrom; recorded <= kTo; recorded += kNsPerSecond) {
      const double ahead_s = double(recorded + offset.ns - clock.due(recorded)) * 1e-9;
      EXPECT_LE(ahead_s, 1e-6) << factor;
      nearest_s = std::min(nearest_s, -ahead_s);
    }
    EXPECT_NEAR(nearest_s, 0, 1e-6) << "and somewhere it is now, factor " << factor;
  }
  const StampOffset real = stamp_offset(Stamps::kNow, {1}, true, kFrom, kTo, kStart);
  EXPECT_EQ(kFrom + real.ns, kStart) << "in real time all of it is now, round after round";
  const StampOffset paced = stamp_offset(Stamps::kNow, {0}, false, kFrom, kTo, kStart);
  EXPECT_EQ(kTo + paced.ns, kStart);
  EXPECT_EQ(stamp_offset(Stamps::kRecorded, {1}, false, kFrom, kTo, kStart).ns, 0);
  for (const StampOffset& none : {stamp_offset(Stamps::kNow, {1}, false, kFrom, kTo, 0),
                                  stamp_offset(Stamps::kNow, {2}, true, kFrom, kTo, kStart)}) {
    EXPECT_EQ(none.ns, 0);
    EXPECT_NE(none.why_recorded, nullptr) << "what was asked for is not done, and said";
  }
}

TEST(Metrics, AreLinesThatPrometheusReads) {
  v1::ServiceStatus s;
  s.crane(3);
  s.service(v1::SERVICE_STEREO);
  v1::DropCount d;
  d.cause("a \"quote\" and a \\");
  d.count(7);
  s.dropped().push_back(d);
  const std::string text = to_metrics(s, {},
                                      {{"map_tiles", "Tiles.", 12, {}},
                                       {"why", "Why.", 0, "a=\"b\""},
                                       {"why", "Why.", 1, "a=\"c\""},
                                       {"refused_total", "So far.", 9, "reason=\"r\"", true}});
  EXPECT_NE(
      text.find("cranemap_dropped_total{crane=\"3\",service=\"stereo\",cause=\"a \\\"quote\\\" "
                "and a \\\\\"} 7\n"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("cranemap_map_tiles{crane=\"3\",service=\"stereo\"} 12\n"),
            std::string::npos);
  EXPECT_NE(
      text.find("# TYPE cranemap_why gauge\ncranemap_why{crane=\"3\",service=\"stereo\",a=\"b\"} "
                "0\ncranemap_why{crane=\"3\",service=\"stereo\",a=\"c\"} 1\n"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("# TYPE cranemap_refused_total counter\ncranemap_refused_total{crane=\"3\","
                      "service=\"stereo\",reason=\"r\"} 9\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("process_threads{"), std::string::npos);
  EXPECT_EQ(text.back(), '\n');
}

TEST(Metrics, StagesAreHistogramsOfFixedBuckets) {
  StageTimes times;
  for (const double ms : {-3.0, 0.05, 1.0, 1.1, 30.0, 70'000.0}) times.add("match", ms);
  v1::ServiceStatus s;
  s.service(v1::SERVICE_STEREO);
  const std::string text = to_metrics(s, times.histograms(), {});
  const auto has = [&](const std::string& name, const std::string& rest) {
    const std::string line = "cranemap_stage_duration_seconds_" + name +
                             "{crane=\"0\",service=\"stereo\",stage=\"match\"" + rest + "\n";
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  };
  has("bucket", ",le=\"0.0001\"} 2");
  has("bucket", ",le=\"0.001\"} 3");  // a bound belongs to its bucket
  has("bucket", ",le=\"0.0025\"} 4");
  has("bucket", ",le=\"0.05\"} 5");
  has("bucket", ",le=\"10\"} 5");
  has("bucket", ",le=\"+Inf\"} 6");
  has("count", "} 6");
  has("sum", "} 70.03215");
}

TEST(Health, AnswersWhatItWasToldAndRefusesAPortThatIsTaken) {
  auto server = HealthServer::start("127.0.0.1", 0);
  ASSERT_TRUE(server) << server.error().text();
  const int port = (*server)->port();
  EXPECT_FALSE(HealthServer::start("127.0.0.1", port)) << "two services on one port";
  (*server)->tell({true, false, "degraded: no cloud", "x 1\n"});
  EXPECT_TRUE(ask_health("127.0.0.1", port));
  (*server)->tell({false, false, "failed: no camera", "x 1\n"});
  const auto failed = ask_health("127.0.0.1", port);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().what.find("failed: no camera"), std::string::npos);
  server->reset();
  EXPECT_EQ(ask_health("127.0.0.1", port).error().code, ErrorCode::kNotAvailable);
}

TEST(Health, FailsWhileAnyThreadOfTheServiceHangs) {
  LoopWatch::Clock::time_point now{};
  LoopWatch watch([&] { return now; });
  const auto follower = watch.watch("map follower", 10s);
  auto server = HealthServer::start("127.0.0.1", 0, {}, watch);
  ASSERT_TRUE(server) << server.error().text();
  (*server)->tell({true, true, "ok", "x 1\n"});
  EXPECT_TRUE(ask_health("127.0.0.1", (*server)->port()));
  now += 11s;
  const auto hangs = ask_health("127.0.0.1", (*server)->port());
  ASSERT_FALSE(hangs);
  EXPECT_NE(hangs.error().what.find("map follower hangs: nothing done for 11 s"), std::string::npos)
      << hangs.error().what;
  follower.turned();
  EXPECT_TRUE(ask_health("127.0.0.1", (*server)->port()));
}

}  // namespace
}  // namespace crane
