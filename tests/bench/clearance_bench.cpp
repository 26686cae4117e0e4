// SPDX-License-Identifier: Apache-2.0
// Clearance over a hall of 60 m x 20 m at 5 cm, as the client library answers it.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <random>

#include "base/clock.hpp"
#include "client/clearance_check.hpp"

namespace crane::client {
namespace {

constexpr double kVoxel = 0.05;

/// Floor, 8 m of free space, and 200 things to stand in the way.
struct Hall {
  std::map<TileKey, ColumnTile> columns;
  std::map<TileKey, HeightColumns> heights;

  Hall() {
    std::mt19937 random(1);
    std::map<std::pair<int, int>, int> tops;  // voxels, by column
    for (int i = 0; i < 200; ++i) {
      const int x0 = static_cast<int>(random() % 1180), y0 = static_cast<int>(random() % 380);
      const int top = 10 + static_cast<int>(random() % 60);
      for (int x = x0; x < x0 + 20; ++x)
        for (int y = y0; y < y0 + 20; ++y) tops[{x, y}] = std::max(tops[{x, y}], top);
    }
    for (int ty = 0; ty < 13; ++ty)
      for (int tx = 0; tx < 38; ++tx) {
        DecodedTile tile;
        for (int z = 0; z < 160; ++z)
          for (int i = 0; i < kTileColumns; ++i) {
            const auto top = tops.find({tx * 32 + i % 32, ty * 32 + i / 32});
            const bool solid = z == 0 || (top != tops.end() && z < top->second);
            auto& byte = tile.blocks[z / 32][std::size_t((z % 32 * kTileColumns + i) / 4)];
            byte = static_cast<std::uint8_t>(byte | (solid ? 2U : 1U) << (2 * (i % 4)));
          }
        columns[{tx, ty}] = columns_of(tile.blocks);
        for (ColumnHeight& c : heights[{tx, ty}].columns) c.last_observed = kNsPerSecond;
        heights[{tx, ty}].sum_up();
      }
  }
  [[nodiscard]] ColumnView view() const {
    return {kVoxel,
            [this](TileKey key) {
              const auto it = columns.find(key);
              return it == columns.end() ? nullptr : &it->second;
            },
            [this](TileKey key) {
              const auto it = heights.find(key);
              return it == heights.end() ? nullptr : &it->second;
            }};
  }
};

/// Argument: 0 straight legs at one height, 1 the load also turns and climbs.
void ClearanceInAHall(benchmark::State& state) {
  static const Hall hall;
  const ColumnView view = hall.view();
  std::mt19937 random(2);
  const auto real = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<double> times_ms;
  std::uint64_t columns = 0;
  std::uint64_t blocked = 0;
  for (auto _ : state) {
    ClearanceQuery q;
    for (int i = 0; i < 3; ++i) q.path.push_back({real(3, 57), real(3, 17), 4, 0});
    if (state.range(0) == 1)
      for (Pose& p : q.path) p.z_m = real(3, 5), p.yaw_rad = real(-1, 1);
    q.load = {3, 2, 1.5, 0.5};
    q.margins = {0.3, 0.2, 0.2, 1.0};
    const Stopwatch watch;
    const Clearance answer = check_clearance(q, view, 2 * kNsPerSecond);
    times_ms.push_back(watch.ms());
    columns += answer.columns;
    blocked += answer.verdict == Verdict::kBlocked ? 1 : 0;
  }
  std::sort(times_ms.begin(), times_ms.end());
  state.counters["p50_ms"] = times_ms[times_ms.size() / 2];
  state.counters["p99_ms"] = times_ms[times_ms.size() * 99 / 100];
  state.counters["columns"] = double(columns) / double(state.iterations());
  state.counters["blocked"] = double(blocked) / double(state.iterations());
}
/// The costliest that is answered: a load as large as the hall that climbs.
void ClearanceAtItsBound(benchmark::State& state) {
  static const Hall hall;
  const ColumnView view = hall.view();
  ClearanceQuery q;
  q.path = {{30, 10, 5, 0}, {30, 10, 5, 0}};
  q.load = {50, 15, 0.5, 0.2};
  q.margins = {0.1, 0.1, 0, 0};
  for (q.path[1].z_m = 7; !query_flaw(q, kVoxel).empty();) q.path[1].z_m -= 0.1;
  std::uint64_t columns = 0;
  for (auto _ : state) columns += check_clearance(q, view, 2 * kNsPerSecond).columns;
  state.counters["columns"] = double(columns) / double(state.iterations());
}
BENCHMARK(ClearanceAtItsBound)->Unit(benchmark::kMillisecond);
BENCHMARK(ClearanceInAHall)->Arg(0)->Arg(1)->ArgName("turning")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace crane::client
