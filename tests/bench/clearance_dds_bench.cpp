// SPDX-License-Identifier: Apache-2.0
// "May the load go there?" over DDS, as a controller without our library asks: request to reply,
// with a map of a hall of 60 m x 20 m at 5 cm served on the same host.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <thread>

#include "bounds.h"
#include "clearance/clearance_server.hpp"
#include "mapper/heartbeat.hpp"
#include "mapper/map_publisher.hpp"
#include "recording/recording.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Floor, things on it, free space up to 8 m.
void fill_hall(OccupancyMap& map) {
  std::mt19937 random(1);
  for (int tx = 0; tx < 38; ++tx)
    for (int ty = 0; ty < 13; ++ty) {
      Tile& tile = map.tile({tx, ty});
      const int top = 4 + static_cast<int>(random() % 40);
      for (int bz = 0; bz < 5; ++bz) {
        Block& block = *map.block(tile, bz);
        for (int i = 0; i < kBlockVoxels; ++i) {
          const int z = bz * kTileEdge + i / kTileColumns, x = i % kTileEdge;
          const bool solid = z == 0 || (x > 10 && x < 16 && z < top);
          block.log_odds[std::size_t(i)] = static_cast<std::int8_t>(solid ? kHit : kMiss);
        }
      }
      for (Column& column : tile.columns) column.last_observed = SystemClock().now();
      tile.reclassified = true;
      map.mark_changed(tile);
    }
}

void ClearanceOverDds(benchmark::State& state) {
  dds::Settings settings;
  settings.domain = 97;
  MapperConfig config;
  config.voxel_m = 0.05;
  MappingPipeline builder(config, Recording::open(CRANEMAP_SOURCE_DIR "/tests/data/rig")->rig());
  fill_hall(builder.map());
  auto mapper = *dds::Participant::create(settings, "mapper");
  auto publisher = *MapPublisher::create(mapper, {1, 42, 7}, false);
  auto heartbeat = *Heartbeat::create(mapper, {1, 42, 7});
  (void)publisher.publish_tiles(builder, true);
  client::Options options;
  options.domain = settings.domain;
  std::string error;
  auto map = client::Map::join(options, error);
  auto* followed = map.get();
  auto service = *dds::Participant::create(settings, "clearance");
  auto server = *ClearanceServer::create(service, std::move(map));
  std::jthread heart([&](const std::stop_token& stop) {  // the mapper goes on beating
    for (; !stop.stop_requested(); std::this_thread::sleep_for(100ms))
      heartbeat->say(publisher.status(builder, {}));
  });
  std::jthread serving([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) (void)server.step(20ms);
  });
  auto controller = *dds::Participant::create(settings, "controller");
  Wakeup wakeup;
  auto replies = *dds::Reader<dds::ClearanceReplyTopic>::create(controller, &wakeup);
  auto requests = *dds::Writer<dds::ClearanceRequestTopic>::create(controller);
  if (!followed->wait_until_complete(20s)) return state.SkipWithError("the map did not arrive");
  while (requests.matched() == 0 || replies.counts().matched == 0)
    std::this_thread::sleep_for(10ms);
  std::this_thread::sleep_for(300ms);

  std::mt19937 random(2);
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<double> times_ms;
  std::uint64_t number = 0, lost = 0, answered = 0;
  for (auto _ : state) {
    v1::ClearanceRequest q;
    q.crane(1);
    q.client(7);
    q.sequence_number(++number);
    q.time_ns(SystemClock().now());
    q.load_size_x_m(3);
    q.load_size_y_m(2);
    q.load_size_z_m(1.5);
    q.margin_horizontal_m(0.3);
    q.margin_vertical_m(0.2);
    q.braking_m(1);
    for (int i = 0; i < 3; ++i) {
      v1::ClearancePose p;
      p.x_m(real(3, 57));
      p.y_m(real(3, 17));
      p.z_m(real(3, 5));
      q.path().push_back(p);
    }
    const Stopwatch watch;
    (void)requests.write(q);
    bool came = false;
    while (!came && watch.ms() < 500) {
      while (const auto reply = replies.take())
        if ((*reply)->sequence_number() == number) {
          came = true;
          answered += (*reply)->verdict() != v1::VERDICT_INVALID ? 1 : 0;
        }
      if (!came) wakeup.wait_for(5ms);
    }
    lost += came ? 0 : 1;
    times_ms.push_back(watch.ms());
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p50_ms"] = times_ms[times_ms.size() / 2];
  state.counters["p99_ms"] = times_ms[times_ms.size() * 99 / 100];
  state.counters["lost"] = double(lost);
  state.counters["answered"] = double(answered) / double(number);
}
BENCHMARK(ClearanceOverDds)->Iterations(1000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace crane
