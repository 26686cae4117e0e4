// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "crane/client/map.hpp"
#include "domain.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapper/heartbeat.hpp"
#include "mapper/map_publisher.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane::test {

/// A mapper's publishing half, and clients of the real library that follow it.
class ClientFixture : public ::testing::Test {
 protected:
  ClientFixture()
      : rig_(Recording::open(rig_recording())->rig()),
        builder_(config(), rig_),
        participant_(*dds::Participant::create(settings(), "mapper")),
        publisher_(*MapPublisher::create(participant_, {1, 42, 7}, false)),
        heartbeat_(*Heartbeat::create(participant_, {1, 42, 7})) {}

  static MapperConfig config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    return c;
  }
  static std::unique_ptr<client::Map> join(client::Options options = {}) {
    options.domain = settings().domain;
    std::string error;
    auto map = client::Map::join(options, error);
    EXPECT_NE(map, nullptr) << error;
    return map;
  }
  /// A flat thing of some height over a tile.
  void put(TileKey key, double height_m) {
    OccupancyMap& map = builder_.map();
    Tile& tile = map.tile(key);
    const int z = map.index(height_m);
    Block& block = *map.block(tile, tile_of(z));
    for (int column = 0; column < kTileColumns; ++column) {
      const int index = in_tile(z) * kTileColumns + column;
      block.log_odds[std::size_t(index)] = 60;
      map.observe_surface(block, index, z, height_m, 1, 2, 3);
      tile.columns[std::size_t(column)].last_observed = kNsPerSecond;
    }
    tile.reclassified = true;
    map.mark_changed(tile);
  }
  void publish() {
    ASSERT_TRUE(publisher_.publish_tiles(builder_, true));
    heartbeat_->say(publisher_.status(builder_, {}));
  }

  StereoRig rig_;
  MappingPipeline builder_;
  std::shared_ptr<dds::Participant> participant_;
  MapPublisher publisher_;
  std::unique_ptr<Heartbeat> heartbeat_;
};

}  // namespace crane::test
