// SPDX-License-Identifier: Apache-2.0
// Lies in the words of another vendor's DDS, against the real client and mapper's publishing half.

#include <gtest/gtest.h>

#include "cyclone.hpp"
#include "integration/client_fixture.hpp"
#include "map_sync/owed_tiles.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

class CycloneLiar : public ClientFixture {
 protected:
  CycloneLiar() {
    for (int i = 0; i < 4; ++i) put({i, 0}, 0.2 + 0.1 * i);
    publish();
  }
  /// Lets it lie while the mapper beats and serves those who ask.
  void lies(const std::string& mode, const std::string& strength) {
    Process liar = cyclone("cyclone_liar", {mode, strength, std::to_string(settings().domain)},
                           folder_ / "liar.txt");
    while (liar.running()) turn();
    EXPECT_EQ(liar.wait(1), 0) << liar.output();
  }
  void turn() {
    while (const auto request = requests_.take()) {
      ++asked_;
      publisher_.note_request(**request);
    }
    EXPECT_TRUE(publisher_.send_again(builder_));
    heartbeat_->say(publisher_.status(builder_, {}));
    std::this_thread::sleep_for(20ms);
  }

  const TempFolder folder_;
  dds::Reader<dds::TileRequestTopic> requests_ =
      *dds::Reader<dds::TileRequestTopic>::create(participant_, nullptr);
  std::uint64_t asked_ = 0;
};

TEST_F(CycloneLiar, AddsNothingToTheMapHoweverStrongItIs) {
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  const client::Status before = map->status();
  for (const char* strength : {"0", "2147483647"}) {
    lies("tiles", strength);
    const client::Status now = map->status();
    EXPECT_TRUE(now.valid && now.complete) << now.reason;
    EXPECT_EQ(now.voxel_digest, before.voxel_digest);
    EXPECT_EQ(now.memory_bytes, before.memory_bytes);
    EXPECT_EQ(map->heights().cells.size(), 4U * 1024);
  }
  ASSERT_TRUE(eventually([&] { return map->status().samples_refused > before.samples_refused; }));
}

TEST_F(CycloneLiar, EndsNoTileAndWhatItKeptBackComesWhenItIsGone) {
  const auto map = join();
  ASSERT_TRUE(map->wait_until_complete(10s));
  lies("ends", "2147483647");
  EXPECT_EQ(map->status().tiles, 4U);
  for (int i = 0; i < 4; ++i) put({i, 0}, 0.5);
  publish();
  EXPECT_TRUE(eventually([&] {
    turn();
    return map->status().complete && std::abs(map->height(0.1, 0.1).height_m - 0.5) < 0.03;
  }));
}

TEST_F(CycloneLiar, WhoAsksWithoutEndIsSentATileNowAndThen) {
  const auto begin = std::chrono::steady_clock::now();
  lies("requests", "0");
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(asked_, 500U) << "the flood has come";
  EXPECT_LE(publisher_.counts().of(Cause::kTilesSentAgain),
            4U * (std::uint64_t(took / OwedTiles::kPause) + 1));
}

}  // namespace
}  // namespace crane::test
