// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "experiments.hpp"
#include "mapping/projective_integrator.hpp"
#include "sim/renderer.hpp"

namespace crane::accuracy {
namespace {

constexpr double kVoxel = 0.05;
constexpr std::array kSquareMetres = {16, 100, 1000, 10'000};
static_assert(kSquareMetres.size() == kMapSizeSteps);

constexpr int kRounds = 25;

/// A map of that many square metres, and what one more frame takes there.
struct Hall {
  int area;
  OccupancyMap map{kVoxel, std::size_t{6} << 30U};
  std::vector<double> times;
};

}  // namespace

Result<void> map_size(Bench& bench) {
  auto scene = shipped_scene("rig");
  if (!scene) return scene.error();
  const StereoRig& rig = scene->camera.rig;
  const CameraModel& c = rig.left;
  const std::vector<float> depth = Renderer(*scene).depth(1.35, 0.95);
  const std::vector<std::uint8_t> confidence(depth.size(), 255);
  DepthFrame frame{c.width,
                   c.height,
                   c.fx_px,
                   c.cx_px,
                   c.cy_px,
                   rig.baseline_m(),
                   0.05,
                   depth.data(),
                   confidence.data(),
                   nullptr,
                   rig.T_map_camera_at_zero};
  ProjectiveIntegrator integrator({-0.3, rig.camera_height_m() - 0.1});
  const auto look_at = [&](int x_m, int y_m) -> const DepthFrame& {
    frame.T_map_rectified.translation().head<2>() = Eigen::Vector2d(x_m, y_m);
    return frame;
  };
  std::deque<Hall> halls;
  for (const int area : kSquareMetres) {
    bench.step("map of " + std::to_string(area) + " square metres");
    Hall& hall = halls.emplace_back(area);
    const int side = static_cast<int>(std::sqrt(area));
    for (int x = 0; x < side; x += 2)
      for (int y = 0; y < side; y += 2) integrator.integrate(look_at(x, y), 1, hall.map);
  }
  for (int round = 0; round < kRounds; ++round)  // in turns: a busy moment of the machine hits all
    for (Hall& hall : halls) {
      const int middle = static_cast<int>(std::sqrt(hall.area)) / 4 * 2;
      const Stopwatch watch;
      integrator.integrate(look_at(middle, middle), 2, hall.map);
      hall.times.push_back(watch.ms());
    }
  Plot plot{"Cost of one more frame", "square metres mapped", "[ms]", {}, {{"one frame", {}}}};
  std::vector<Row> rows;
  for (Hall& hall : halls) {
    std::nth_element(hall.times.begin(), hall.times.begin() + kRounds / 2, hall.times.end());
    const double ms = hall.times[kRounds / 2];
    const double bytes = double(hall.map.memory_bytes());
    plot.labels.push_back(std::to_string(hall.area));
    plot.lines[0].values.push_back(ms);
    rows.push_back({std::to_string(hall.area), fixed(ms, 2), fixed(bytes * 1e-6, 1),
                    fixed(bytes * 1e-3 / hall.area, 0)});
  }
  bench.document.section("Cost against the size of the map");
  bench.document.text(
      "One frame of 1280 x 720 into a map that is already large, voxel 5 cm, camera 1.95 m above "
      "the floor, median of 25 in turns.");
  bench.document.plot(plot);
  bench.document.table({"square metres", "one frame [ms]", "memory [MB]", "kB per square metre"},
                       rows);
  return {};
}

}  // namespace crane::accuracy
