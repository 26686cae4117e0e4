// SPDX-License-Identifier: Apache-2.0
// Cost of each stage on the rig's first frame, and beside it what OctoMap takes to insert the same
// cloud. usage: tests/bench/run [--benchmark_filter=...]

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "base/clock.hpp"
#include "base/stage_times.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/projective_integrator.hpp"
#include "motion/motion_stereo.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "stereo/stereo_stage.hpp"
#include "watchdog/watchdog.hpp"

namespace crane {
namespace {

constexpr std::size_t kPixels = 1280 * 720;

/// The first frame of the rig, matched once.
struct Frame {
  StereoStage stage;
  Image left, right;
  std::vector<float> depth = std::vector<float>(kPixels);
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kPixels);
  std::vector<std::uint8_t> colour = std::vector<std::uint8_t>(3 * kPixels);
  DepthFrame cloud;

  Frame() : Frame(*Recording::open(CRANEMAP_SOURCE_DIR "/tests/data/rig")) {}
  explicit Frame(const Recording& recording)
      : stage(*StereoStage::create(recording.rig(), {})),
        left(*read_image(recording.frames()[0].left_file, kPixels)),
        right(*read_image(recording.frames()[0].right_file, kPixels)) {
    (void)stage.rectify({left.view(), right.view()});
    (void)stage.match({depth, confidence, colour});
    const RectifiedCamera& c = stage.camera();
    cloud = {1280,
             720,
             c.f_px,
             c.cx_px,
             c.cy_px,
             c.baseline_m,
             0.05,
             depth.data(),
             confidence.data(),
             colour.data(),
             recording.rig().T_map_camera_at_zero};
  }
};

Frame& frame() {
  static Frame f;
  return f;
}

void Rectify(benchmark::State& state) {
  Frame& f = frame();
  for (auto _ : state) (void)f.stage.rectify({f.left.view(), f.right.view()});
}
BENCHMARK(Rectify)->Unit(benchmark::kMillisecond)->UseRealTime();

void Match(benchmark::State& state) {
  Frame& f = frame();
  for (auto _ : state) (void)f.stage.match({f.depth, f.confidence, f.colour});
}
BENCHMARK(Match)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A bare floor 10 m below with boxes on it, as a camera of 0.5 m baseline sees it; noise 0.25 px.
struct HallFrame {
  std::vector<float> depth = std::vector<float>(kPixels);
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kPixels, 51);
  DepthFrame cloud;

  HallFrame() {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.25);
    constexpr double kFocal = 700, kBaseline = 0.5;
    for (int v = 0; v < 720; ++v)
      for (int u = 0; u < 1280; ++u) {
        const bool box = u % 320 > 200 && v % 240 > 150;
        const double z = box ? 8.5 : 10.0;
        depth[std::size_t(v) * 1280 + u] =
            static_cast<float>(kFocal * kBaseline / (kFocal * kBaseline / z + noise(random)));
      }
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    T.translation().z() = 10;
    cloud = {1280,    720, kFocal, 639.5, 359.5, kBaseline, 0.05, depth.data(), confidence.data(),
             nullptr, T};
  }
};

const DepthFrame& cloud_from(double height_m) {
  static HallFrame hall;
  return height_m > 5 ? hall.cloud : frame().cloud;
}

/// Arguments: camera height in metres (2: the rig's first frame, 10: HallFrame), voxel in mm.
void Integrate(benchmark::State& state) {
  OccupancyMap map(double(state.range(1)) * 1e-3, std::size_t{8} << 30U);
  ProjectiveIntegrator integrator({-0.3, double(state.range(0)) - 0.1});
  for (auto _ : state) integrator.integrate(cloud_from(double(state.range(0))), 1, map);
}
BENCHMARK(Integrate)
    ->ArgsProduct({{2, 10}, {20, 50, 100}})
    ->ArgNames({"height_m", "voxel_mm"})
    ->Unit(benchmark::kMillisecond);

/// The same clouds into OctoMap; `ratio`: its time over ours, measured right before.
void octomap_insert(benchmark::State& state, bool discretised_lazy) {
  const DepthFrame& cloud = cloud_from(double(state.range(0)));
  const double voxel = double(state.range(1)) * 1e-3;
  OccupancyMap map(voxel, std::size_t{8} << 30U);
  ProjectiveIntegrator integrator({-0.3, double(state.range(0)) - 0.1});
  std::vector<double> ours;
  for (int i = 0; i < 15; ++i) {
    const Stopwatch watch;
    integrator.integrate(cloud, 1, map);
    ours.push_back(watch.ms());
  }
  std::nth_element(ours.begin(), ours.begin() + 7, ours.end());
  octomap::Pointcloud points;
  for (const Point& p : to_points(cloud, 60)) points.push_back(p.x, p.y, p.z);
  const Eigen::Vector3f origin = cloud.T_map_rectified.translation().cast<float>();
  octomap::OcTree tree(voxel);
  double total_ms = 0;
  for (auto _ : state) {
    const Stopwatch watch;
    tree.insertPointCloud(points, octomap::point3d(origin.x(), origin.y(), origin.z()), -1,
                          discretised_lazy, discretised_lazy);
    total_ms += watch.ms();
  }
  state.counters["ours_ms"] = ours[7];
  state.counters["ratio"] = total_ms / double(state.iterations()) / ours[7];
}
void OctomapInsert(benchmark::State& state) {
  octomap_insert(state, false);
}
void OctomapInsertDiscretisedLazy(benchmark::State& state) {
  octomap_insert(state, true);
}
BENCHMARK(OctomapInsert)
    ->ArgsProduct({{2, 10}, {50, 100}})
    ->ArgNames({"height_m", "voxel_mm"})
    ->Iterations(2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(OctomapInsertDiscretisedLazy)
    ->ArgsProduct({{2, 10}, {50, 100}})
    ->ArgNames({"height_m", "voxel_mm"})
    ->Iterations(2)
    ->Unit(benchmark::kMillisecond);

/// The rig's frame into maps that are already large: argument: square metres of hall at 5 cm.
void IntegrateIntoLargeMap(benchmark::State& state) {
  OccupancyMap map(0.05, std::size_t{12} << 30U);
  ProjectiveIntegrator integrator({-0.3, 1.85});
  DepthFrame moved = frame().cloud;
  const auto side = static_cast<int>(std::sqrt(double(state.range(0))) / 2);
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y) {
      moved.T_map_rectified.translation().head<2>() = Eigen::Vector2d(2 * x, 2 * y);
      integrator.integrate(moved, 1, map);
    }
  for (auto _ : state) integrator.integrate(frame().cloud, 2, map);
  state.counters["MiB"] = double(map.memory_bytes()) / (1 << 20);
  state.counters["kB_per_m2"] =
      double(map.memory_bytes()) / 1e3 / std::max(1.0, double(state.range(0)));
}
BENCHMARK(IntegrateIntoLargeMap)
    ->Arg(16)
    ->Arg(1000)
    ->Arg(10000)
    ->ArgName("m2")
    ->Unit(benchmark::kMillisecond);

void EncodeTiles(benchmark::State& state) {
  OccupancyMap map(0.02, std::size_t{4} << 30U);
  ProjectiveIntegrator({-0.3, 1.85}).integrate(frame().cloud, 1, map);
  for (auto _ : state)
    for (const Tile* tile : map.tiles()) {
      for (const int band : known_bands(*tile)) benchmark::DoNotOptimize(encode_tile(*tile, band));
      benchmark::DoNotOptimize(encode_heights(tile_heights(map, *tile, 0.03)));
    }
  state.counters["tiles"] = double(map.tiles().size());
}
BENCHMARK(EncodeTiles)->Unit(benchmark::kMillisecond);

void WriteBt(benchmark::State& state) {
  OccupancyMap map(0.02, std::size_t{4} << 30U);
  ProjectiveIntegrator({-0.3, 1.85}).integrate(frame().cloud, 1, map);
  for (auto _ : state) benchmark::DoNotOptimize(write_bt(map));
}
BENCHMARK(WriteBt)->Unit(benchmark::kMillisecond);

/// The octree of 10,000 square metres at 5 cm, with one tile changed since the last time.
void WriteBtOfLargeHall(benchmark::State& state) {
  OccupancyMap map(0.05, std::size_t{4} << 30U);
  ProjectiveIntegrator integrator({-0.3, 1.85});
  DepthFrame moved = frame().cloud;
  for (int x = 0; x < 50; ++x)
    for (int y = 0; y < 50; ++y) {
      moved.T_map_rectified.translation().head<2>() = Eigen::Vector2d(2 * x, 2 * y);
      integrator.integrate(moved, 1, map);
    }
  const TileKey changed = map.tiles()[map.tiles().size() / 2]->key;
  BtWriter writer;
  std::size_t bytes = writer.write(map).size();
  for (auto _ : state) {
    if (state.range(0) == 1) {
      writer.changed(changed);
      bytes = writer.write(map).size();
    } else {
      bytes = write_bt(map).size();
    }
  }
  state.counters["MB"] = double(bytes) * 1e-6;
}
BENCHMARK(WriteBtOfLargeHall)
    ->Arg(0)
    ->Arg(1)
    ->ArgName("incremental")
    ->Unit(benchmark::kMillisecond);

/// A camera that goes to and fro: the same frame, placed half a millimetre further each time.
void Watch(benchmark::State& state) {
  DepthFrame moved = frame().cloud;
  Watchdog watchdog(WatchdogLimits{}, 1.95, moved.baseline_m);
  Watchdog::Sight sight;
  int n = 0;
  for (auto _ : state) {
    ++n;
    sight.exposure = n * kNsPerSecond / 10;
    sight.place_m.x() = 0.0005 * (n % 20);
    moved.T_map_rectified.translation().x() = sight.place_m.x();
    benchmark::DoNotOptimize(watchdog.look(moved, sight));
  }
}
BENCHMARK(Watch)->Unit(benchmark::kMillisecond);

/// What the rig's first frame would be from `right_px`, `down_px` beside, if all were floor.
struct MovedFrame {
  std::vector<float> depth = std::vector<float>(kPixels);
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kPixels);
  std::vector<std::uint8_t> colour = std::vector<std::uint8_t>(3 * kPixels);
  DepthFrame cloud = frame().cloud;

  MovedFrame(int right_px, int down_px) {
    const Frame& from = frame();
    for (std::size_t v = 0; v < 720; ++v)
      for (std::size_t u = 0; u < 1280; ++u) {
        const std::size_t to = v * 1280 + u;
        const std::size_t i =
            (v + std::size_t(down_px)) % 720 * 1280 + (u + std::size_t(right_px)) % 1280;
        depth[to] = from.depth[i];
        confidence[to] = from.confidence[i];
        std::copy_n(from.colour.data() + 3 * i, 3, colour.data() + 3 * to);
      }
    const Eigen::Vector3d metres = cloud.T_map_rectified.linear() *
                                   Eigen::Vector3d(right_px, down_px, 0) *
                                   cloud.T_map_rectified.translation().z() / cloud.f_px;
    cloud.T_map_rectified.translation() += Eigen::Vector3d(metres.x(), metres.y(), 0);
    cloud.colour = colour.data();
  }
};

/// Ten frames a second, around a square of a third of a metre. Arguments: 0 = the pair as it is,
/// 1 = so uncertain that all its depths are sharpened.
void ImproveByMotion(benchmark::State& state) {
  std::vector<std::unique_ptr<MovedFrame>> frames;
  for (const auto& [right_px, down_px] : {std::pair{0, 0}, {120, 0}, {120, 120}, {0, 120}}) {
    frames.push_back(std::make_unique<MovedFrame>(right_px, down_px));
    if (state.range(0) != 0) frames.back()->cloud.sigma_disparity_px *= 10;
  }
  MotionStereo motion;
  std::vector<float> depth;
  std::vector<std::uint8_t> confidence;
  std::size_t n = 0, cells = 0, refined = 0;
  for (auto _ : state) {
    const MovedFrame& from = *frames[n % frames.size()];
    depth = from.depth;
    confidence = from.confidence;
    DepthFrame f = from.cloud;
    f.depth_m = depth.data();
    f.confidence = confidence.data();
    const Stopwatch watch;
    const MotionReport report =
        motion.improve(f, TimeNs(++n) * kNsPerSecond / 10, depth, confidence);
    state.SetIterationTime(watch.ms() * 1e-3);
    cells += report.cells;
    refined += report.refined;
  }
  state.counters["cells"] = double(cells) / double(n);
  state.counters["sharpened_px"] = double(refined) / double(n);
}
BENCHMARK(ImproveByMotion)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace crane
