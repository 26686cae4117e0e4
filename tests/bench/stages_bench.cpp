// Cost of each stage on the rig's first frame, and beside it what OctoMap takes to insert the same
// cloud. usage: tests/bench/run [--benchmark_filter=...]

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/projective_integrator.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "stereo/stereo_stage.hpp"

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
    (void)stage.rectify({left.bytes.data(), right.bytes.data(), 1280, 720, 3});
    (void)stage.match({depth, confidence, colour});
    const RectifiedCamera& c = stage.camera();
    cloud = {1280,
             720,
             c.f_px,
             c.cx_px,
             c.cy_px,
             c.baseline_m,
             0.15,
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
  for (auto _ : state)
    (void)f.stage.rectify({f.left.bytes.data(), f.right.bytes.data(), 1280, 720, 3});
}
BENCHMARK(Rectify)->Unit(benchmark::kMillisecond)->UseRealTime();

void Match(benchmark::State& state) {
  Frame& f = frame();
  for (auto _ : state) (void)f.stage.match({f.depth, f.confidence, f.colour});
}
BENCHMARK(Match)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Argument: voxel edge in millimetres.
void Integrate(benchmark::State& state) {
  OccupancyMap map(double(state.range(0)) * 1e-3, std::size_t{4} << 30U);
  ProjectiveIntegrator integrator({-0.3, 1.85});
  for (auto _ : state) integrator.integrate(frame().cloud, 1, map);
}
BENCHMARK(Integrate)->Arg(20)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

void OctomapInsert(benchmark::State& state) {
  octomap::Pointcloud points;
  for (const Point& p : to_points(frame().cloud, 60)) points.push_back(p.x, p.y, p.z);
  octomap::OcTree tree(double(state.range(0)) * 1e-3);
  for (auto _ : state) tree.insertPointCloud(points, octomap::point3d(0, 0, 1.95F));
}
BENCHMARK(OctomapInsert)->Arg(50)->Arg(100)->Unit(benchmark::kMillisecond);

void EncodeTiles(benchmark::State& state) {
  OccupancyMap map(0.02, std::size_t{4} << 30U);
  ProjectiveIntegrator({-0.3, 1.85}).integrate(frame().cloud, 1, map);
  for (auto _ : state)
    for (const Tile* tile : map.tiles()) {
      benchmark::DoNotOptimize(encode_tile(*tile));
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

}  // namespace
}  // namespace crane
