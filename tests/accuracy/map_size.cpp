#include <algorithm>
#include <array>
#include <cmath>

#include "experiments.hpp"
#include "mapping/projective_integrator.hpp"
#include "sim/renderer.hpp"

namespace crane::accuracy {
namespace {

constexpr double kVoxel = 0.05;
constexpr std::array kSquareMetres = {16, 100, 1000, 10'000};
static_assert(kSquareMetres.size() == kMapSizeSteps);

double median_ms(ProjectiveIntegrator& integrator, const DepthFrame& frame, OccupancyMap& map) {
  std::vector<double> times;
  for (int i = 0; i < 25; ++i) {
    const Stopwatch watch;
    integrator.integrate(frame, 2, map);
    times.push_back(watch.ms());
  }
  std::nth_element(times.begin(), times.begin() + 12, times.end());
  return times[12];
}

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
  Plot plot{"Cost of one more frame", "square metres mapped", "[ms]", {}, {{"one frame", {}}}};
  std::vector<Row> rows;
  for (const int area : kSquareMetres) {
    bench.step("map of " + std::to_string(area) + " square metres");
    OccupancyMap map(kVoxel, std::size_t{6} << 30U);
    ProjectiveIntegrator integrator({-0.3, rig.camera_height_m() - 0.1});
    const auto steps = static_cast<int>(std::sqrt(double(area)) / 2);
    for (int x = 0; x < steps; ++x)
      for (int y = 0; y < steps; ++y) {
        frame.T_map_rectified.translation().head<2>() = Eigen::Vector2d(2 * x, 2 * y);
        integrator.integrate(frame, 1, map);
      }
    frame.T_map_rectified.translation().head<2>() = Eigen::Vector2d(steps, steps);
    const double ms = median_ms(integrator, frame, map);
    plot.labels.push_back(std::to_string(area));
    plot.lines[0].values.push_back(ms);
    rows.push_back({std::to_string(area), fixed(ms, 2), fixed(double(map.memory_bytes()) * 1e-6, 1),
                    fixed(double(map.memory_bytes()) * 1e-3 / area, 0)});
  }
  bench.document.section("Cost against the size of the map");
  bench.document.text(
      "One frame of 1280 x 720 into a map that is already large, voxel 5 cm, camera 1.95 m above "
      "the floor, median of 25.");
  bench.document.plot(plot);
  bench.document.table({"square metres", "one frame [ms]", "memory [MB]", "kB per square metre"},
                       rows);
  return {};
}

}  // namespace crane::accuracy
