// SPDX-License-Identifier: Apache-2.0
// Memory that runs out at any moment, in the thread that follows the map and in the one that asks:
// nothing is thrown into a controller, and no answer is made of half a map.

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "client_fixture.hpp"
#include "map_sync/map_follower.hpp"

namespace {

/// So many allocations of this thread succeed yet; below 0: all.
thread_local long g_left = -1;

}  // namespace

void* operator new(std::size_t bytes) {
  if (g_left == 0) throw std::bad_alloc();
  if (g_left > 0) --g_left;
  if (void* memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}
// GCC sees the new of the library where this file's own is.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*bytes*/) noexcept {
  std::free(memory);
}
#pragma GCC diagnostic pop

namespace crane {
namespace {

using namespace std::chrono_literals;
using OutOfMemory = test::ClientFixture;

/// What runs meanwhile has memory for so many allocations only.
class Memory {
 public:
  explicit Memory(long allocations) { g_left = allocations; }
  ~Memory() { g_left = -1; }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
};

TEST_F(OutOfMemory, TheFollowerGivesTheMapUpAndSaysWhy) {
  for (int i = 0; i < 4; ++i) put({i, 0}, 0.5);
  publish();
  auto participant = *dds::Participant::create(test::settings(), "follower");
  int given_up = 0;
  for (const long allocations : {0, 2, 5, 9, 14, 20, 27, 35, 60, 100, 200}) {
    Wakeup wakeup;
    auto follower = *MapFollower::create(participant, &wakeup, HeldMap::kNoBound);
    ASSERT_TRUE(test::eventually([&] {  // the status is there, and the tiles are
      heartbeat_->say(publisher_.status(builder_, {}));
      if (!follower->said()) (void)follower->step();
      return follower->said().has_value();
    }));
    for (int i = 0; i < 4; ++i) put({i, 0}, 0.6 + 0.001 * double(allocations));
    publish();
    publisher_.flush(1s);
    std::this_thread::sleep_for(50ms);
    {
      const Memory little(allocations);
      (void)follower->step();
    }
    if (follower->trouble().empty()) continue;
    ++given_up;
    EXPECT_FALSE(follower->complete());
    EXPECT_EQ(follower->held().memory_bytes(), 0U);
    EXPECT_EQ(follower->held().voxel_digests().all, 0U);
    (void)follower->step();  // goes on with what comes
  }
  EXPECT_GT(given_up, 3);
}

TEST_F(OutOfMemory, WhoAsksIsToldThatNothingIsKnown) {
  for (int i = 0; i < 4; ++i) put({i, 0}, 0.5);
  publish();
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  client::ClearanceQuery query;
  query.path = {{0.5, 0.5, 2, 0}, {3, 0.5, 2, 0}};
  query.load = {0.2, 0.2, 0.2};
  const test::TempFolder folder;
  const std::string path = folder / "held.bt";
  for (long allocations = 0; allocations < 40; ++allocations) {
    heartbeat_->say(publisher_.status(builder_, {}));
    std::string error;
    const Memory little(allocations);
    const client::Clearance answer = map->clearance(query);
    g_left = allocations;
    const client::Status status = map->status();
    g_left = allocations;
    const client::HeightGrid grid = map->heights();
    g_left = allocations;
    const bool saved = map->save_bt(path, error);
    g_left = allocations;
    (void)map->zones();
    (void)map->max_height({0, 0, 1, 1});
    (void)map->count_voxels();
    const bool set = map->on_update([&](const client::Update&) {});
    g_left = -1;
    map->on_update(nullptr);
    EXPECT_NE(answer.verdict, client::Verdict::kClear);
    EXPECT_TRUE(grid.cells.empty() || grid.cells.size() == 4U * 1024);
    EXPECT_TRUE(saved || !error.empty());
    EXPECT_TRUE(status.valid || !status.reason.empty());
    if (allocations == 0) {
      EXPECT_FALSE(set);
      EXPECT_TRUE(grid.cells.empty());
      EXPECT_EQ(answer.reason, client::Reason::kMapInvalid);
      EXPECT_EQ(answer.text, "out of memory");
    }
  }
  EXPECT_TRUE(map->wait_until_complete(5s));
}

}  // namespace
}  // namespace crane
