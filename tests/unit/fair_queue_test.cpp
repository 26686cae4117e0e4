// SPDX-License-Identifier: Apache-2.0
#include "service/fair_queue.hpp"

#include <gtest/gtest.h>

#include "service/request_gate.hpp"
#include "service/stream_gate.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

TEST(FairQueue, TakesOneOfEachClientInTurn) {
  FairQueue<int, int> queue(100, 3);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(queue.push(1, 100 + i));
  ASSERT_TRUE(queue.push(2, 200));
  ASSERT_TRUE(queue.push(0, 300));
  EXPECT_EQ(queue.pop(), 300);
  EXPECT_EQ(queue.pop(), 100);
  EXPECT_EQ(queue.pop(), 200);
  EXPECT_EQ(queue.pop(), 101);
  ASSERT_TRUE(queue.push(2, 201));
  EXPECT_EQ(queue.pop(), 201) << "behind one of the other's, not behind all";
  for (int i = 2; i < 50; ++i) EXPECT_EQ(queue.pop(), 100 + i);
  EXPECT_FALSE(queue.pop());
  EXPECT_TRUE(queue.empty());
}

TEST(FairQueue, RefusesWhatHasNoRoom) {
  FairQueue<int, int> queue(2, 2);
  EXPECT_TRUE(queue.push(1, 0));
  EXPECT_TRUE(queue.push(1, 0));
  EXPECT_FALSE(queue.push(1, 0));
  EXPECT_TRUE(queue.push(2, 0));
  EXPECT_FALSE(queue.push(3, 0));
  (void)queue.pop();
  (void)queue.pop();
  EXPECT_TRUE(queue.push(3, 0)) << "a client that has been answered takes no room";
}

TEST(RequestGate, LetsOneRequestOfEachClientThroughAPause) {
  RequestGate<int> gate(500ms);
  const auto at = [](int ms) {
    return std::chrono::steady_clock::time_point(1h + std::chrono::milliseconds(ms));
  };
  int passed = 0;
  for (int ms = 0; ms < 5000; ++ms) passed += gate.pass(1, at(ms)) ? 1 : 0;
  EXPECT_EQ(passed, 10);
  EXPECT_TRUE(gate.pass(2, at(4999)));
  for (int client = 100; client < 10'000; ++client) EXPECT_TRUE(gate.pass(client, at(5000)));
}

TEST(SourceGate, LetsAnotherOneThroughOnceTheFirstIsSilent) {
  SourceGate<int> gate(500ms);
  const auto at = [](int ms) {
    return std::chrono::steady_clock::time_point(1h + std::chrono::milliseconds(ms));
  };
  for (int ms = 0; ms < 2000; ms += 100) {
    EXPECT_TRUE(gate.pass(1, at(ms)));
    EXPECT_FALSE(gate.pass(2, at(ms + 50)));
  }
  EXPECT_FALSE(gate.pass(2, at(2300)));
  EXPECT_TRUE(gate.pass(2, at(2400)));
  EXPECT_FALSE(gate.pass(1, at(2401)));
}

}  // namespace
}  // namespace crane
