// SPDX-License-Identifier: Apache-2.0
#include "trial.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "cloud/pcl_filters.hpp"
#include "geometry/calibration_digest.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/heights.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "recording/image_file.hpp"
#include "sim/meshes.hpp"
#include "sim/simulate.hpp"

namespace crane::accuracy {
namespace {

/// Positions as the mapper gets them, or only the nearest one to each frame, on both sides of it.
void add_positions(const Recording& recording, bool nearest, MappingPipeline& builder) {
  for (const Axis axis : {Axis::kCart, Axis::kTrolley}) {
    const auto& readings = axis == Axis::kCart ? recording.cart() : recording.trolley();
    if (!nearest) {
      for (const RecordedDistance& r : readings)
        builder.add_position(axis, 1, r.time, r.distance_m);
      continue;
    }
    for (const RecordedFrame& frame : recording.frames()) {
      const auto distance = [&](const RecordedDistance& r) {
        return std::abs(r.time - frame.time);
      };
      const auto best =
          std::min_element(readings.begin(), readings.end(),
                           [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
      for (const TimeNs side : {-1'000'000, 1'000'000})
        builder.add_position(axis, 1, frame.time + side, best->distance_m);
    }
  }
}

CloudSample cloud_of(const RectifiedCamera& camera, std::uint64_t calibration,
                     double sigma_disparity_px, std::size_t number, TimeNs time) {
  CloudSample cloud;
  const std::size_t pixels = std::size_t(camera.width) * camera.height;
  cloud.calibration = calibration;
  cloud.stream = 1;
  cloud.sequence_number = number;
  cloud.after = static_cast<std::int64_t>(number) - 1;
  cloud.exposure_time = time;
  cloud.depth_m.resize(pixels);
  cloud.confidence.resize(pixels);
  cloud.colour.resize(3 * pixels);
  cloud.R_camera_rectified = camera.R_camera_rectified;
  cloud.frame.width = camera.width;
  cloud.frame.height = camera.height;
  cloud.frame.f_px = camera.f_px;
  cloud.frame.cx_px = camera.cx_px;
  cloud.frame.cy_px = camera.cy_px;
  cloud.frame.baseline_m = camera.baseline_m;
  cloud.frame.sigma_disparity_px = sigma_disparity_px;
  return cloud;
}

/// What the mapper hands on after a change.
void encode_changes(OccupancyMap& map) {
  for (Tile* tile : map.changed_tiles()) {
    for (const int band : known_bands(*tile)) (void)encode_tile(*tile, band);
    (void)encode_heights(tile_heights(map, *tile, floor_tolerance_m(map.voxel_m())));
    tile->changed = tile->reclassified = tile->moved = false;
  }
}

client::HeightGrid grid_of(const OccupancyMap& map, bool voxel_tops) {
  client::HeightGrid grid;
  const std::vector<const Tile*> tiles = map.tiles();
  if (tiles.empty()) return grid;
  TileKey low = tiles.front()->key;
  TileKey high = low;
  for (const Tile* t : tiles) {
    low = {std::min(low.x, t->key.x), std::min(low.y, t->key.y)};
    high = {std::max(high.x, t->key.x), std::max(high.y, t->key.y)};
  }
  grid.cell_m = map.voxel_m();
  grid.origin_x_m = low.x * kTileEdge * map.voxel_m();
  grid.origin_y_m = low.y * kTileEdge * map.voxel_m();
  grid.columns = static_cast<std::uint32_t>((high.x - low.x + 1) * kTileEdge);
  grid.rows = static_cast<std::uint32_t>((high.y - low.y + 1) * kTileEdge);
  grid.cells.resize(std::size_t(grid.columns) * grid.rows);
  for (const Tile* t : tiles) {
    const TileHeights heights = tile_heights(map, *t, floor_tolerance_m(map.voxel_m()));
    for (int i = 0; i < kTileColumns; ++i) {
      const ColumnHeight& from = heights[static_cast<std::size_t>(i)];
      if (!is_known(from.state)) continue;
      const int column = (t->key.x - low.x) * kTileEdge + i % kTileEdge;
      const int row = (t->key.y - low.y) * kTileEdge + i / kTileEdge;
      client::Height& to =
          grid.cells[std::size_t(row) * grid.columns + static_cast<std::size_t>(column)];
      to.surface =
          from.state == ColumnState::kFloor ? client::Surface::kFloor : client::Surface::kObstacle;
      to.height_m = voxel_tops ? (map.index(from.height_m) + 1) * map.voxel_m() : from.height_m;
    }
  }
  return grid;
}

/// Distance between the middle of a top as mapped and as true.
double offset_of(const TrueObstacle& o, const client::HeightGrid& grid) {
  constexpr double kAround = 0.25, kLevel = 0.15;  // [m]; [of the height]
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    const Eigen::Vector2d p(grid.x_m(i) - o.x_m, grid.y_m(i) - o.y_m);
    if (grid.cells[i].surface != client::Surface::kObstacle ||
        p.norm() > std::max(o.radius_m, std::hypot(o.size_x_m, o.size_y_m) / 2) + kAround ||
        std::abs(grid.cells[i].height_m - o.height_m) > kLevel * o.height_m)
      continue;
    sum += p;
    ++count;
  }
  return count > 0 ? sum.norm() / count : 0;
}

/// Calls fn(class, x, y, z) with the centre of every known voxel.
template <class Fn>
void for_each_known(const OccupancyMap& map, Fn fn) {
  for (const Tile* tile : map.tiles())
    for (const auto& [block_z, block] : tile->blocks)
      for (int i = 0; i < kBlockVoxels; ++i)
        if (const Occupancy class_ = block->at(i); class_ != Occupancy::kUnknown)
          fn(class_, map.centre(tile->key.x * kTileEdge + i % kTileEdge),
             map.centre(tile->key.y * kTileEdge + i / kTileEdge % kTileEdge),
             map.centre(block_z * kTileEdge + i / kTileColumns));
}

Result<void> judge_map(const OccupancyMap& map, const Recording& recording, const Scene& scene,
                       const Method& method, Outcome& out) {
  auto truth = read_truth(recording.folder() + "/truth");
  if (!truth) return truth.error();
  std::uint64_t wrong = 0;
  for_each_known(map, [&](Occupancy class_, double x, double y, double z) {
    if (class_ == Occupancy::kOccupied) {
      out.occupied.push_back({x, y, z, map.voxel_m()});
      return;
    }
    ++out.free_voxels;
    if (!method.free_precision) return;
    if (z < 0 ||
        std::any_of(scene.obstacles.begin(), scene.obstacles.end(), [&](const SceneObstacle& o) {
          return inside(o, {x, y, z});
        }))
      ++wrong;
  });
  Evaluation evaluation = evaluate(JudgedMap::from_map(map), *truth, {method.queries});
  out.judgement = evaluation.columns;
  out.cells = std::move(evaluation.cells);
  out.clearance = std::move(evaluation.clearance);
  if (out.free_voxels > 0) out.free_precision = 1 - double(wrong) / double(out.free_voxels);
  return {};
}

Result<void> measure_files(MappingPipeline& builder, const std::string& folder, Outcome& out) {
  out.bt_bytes = write_bt(builder.map()).size();
  out.ot_bytes = write_colour_ot(builder.map()).size();
  const PointCloud cloud =
      builder.paper_cloud() != nullptr ? *builder.paper_cloud() : builder.map().occupied_points();
  if (cloud.empty()) return {};
  const std::string path = folder + "/size.pcd";
  if (auto written = write_pcd(path, cloud); !written) return written;
  out.pcd_bytes = std::filesystem::file_size(path);
  std::filesystem::remove(path);
  return {};
}

}  // namespace

Method cranemap_method(double voxel_m) {
  Method m;
  m.mapper.voxel_m = voxel_m;
  return m;
}

Method paper_method(double voxel_m, int outlier_neighbours, double outlier_std) {
  Method m;
  m.stereo.matcher = StereoSettings::Matcher::kBlock;
  m.stereo.paper = true;
  m.mapper.method = MapperConfig::Method::kPaper;
  m.mapper.voxel_m = voxel_m;
  m.mapper.outlier_neighbours = outlier_neighbours;
  m.mapper.outlier_std = outlier_std;
  m.voxel_tops = true;
  return m;
}

double Outcome::worst_percent() const {
  double worst = 0;
  for (const ObstacleHeight& h : heights) worst = std::max(worst, h.error_percent());
  return worst;
}

double Outcome::mean_percent() const {
  double sum = 0;
  for (const ObstacleHeight& h : heights) sum += h.error_percent();
  return heights.empty() ? 0 : sum / double(heights.size());
}

Result<Outcome> run_trial(const Recording& recording, const Scene& scene, const Method& method) {
  auto stage = StereoStage::create(recording.rig(), method.stereo);
  if (!stage) return stage.error();
  if (auto fits = MappingPipeline::check(method.mapper, recording.rig()); !fits)
    return fits.error();
  MappingPipeline builder(method.mapper, recording.rig(), method.hoist);
  add_positions(recording, method.nearest_position, builder);
  for (const HoistReading& reading : recording.hoist()) builder.add_hoist(reading);
  const std::uint64_t calibration = calibration_digest(recording.rig());
  Outcome out;
  double update_ms = 0;
  std::size_t updates = 0;
  for (std::size_t n = 0; n < recording.frames().size(); ++n) {
    const RecordedFrame& frame = recording.frames()[n];
    const CameraModel& c = recording.rig().left;
    auto left = read_image(frame.left_file, std::uint64_t(c.width) * c.height, c.bits);
    if (!left) return left.error();
    auto right = read_image(frame.right_file, std::uint64_t(c.width) * c.height, c.bits);
    if (!right) return right.error();
    CloudSample cloud =
        cloud_of(stage->camera(), calibration, StereoConfig{}.sigma_disparity_px, n, frame.time);
    const Stopwatch cloud_watch;
    auto rectified = stage->rectify({left->view(), right->view(), static_cast<int>(n)});
    if (!rectified) return rectified.error();
    auto matched = stage->match({cloud.depth_m, cloud.confidence, cloud.colour});
    if (!matched) return matched.error();
    out.cloud_ms += cloud_watch.ms();
    builder.add_cloud(std::move(cloud), frame.time);
    const Stopwatch update_watch;
    builder.step(frame.time);
    if (method.watch) method.watch(n, builder.map());
    if (builder.needs_rebuild()) continue;
    encode_changes(builder.map());
    update_ms += update_watch.ms();
    ++updates;
  }
  if (builder.needs_rebuild()) {
    const Stopwatch watch;
    if (auto made = builder.rebuild(); !made) return made.error();
    update_ms = watch.ms();
    updates = 1;
  }
  out.frames = builder.account().integrated;
  out.cloud_ms /= double(std::max<std::size_t>(1, recording.frames().size()));
  out.update_ms = update_ms / double(std::max<std::size_t>(1, updates));
  out.grid = grid_of(builder.map(), method.voxel_tops);
  std::vector<TrueObstacle> obstacles;
  for (const SceneObstacle& o : scene.obstacles) obstacles.push_back(o.shape);
  out.heights = measure(out.grid, obstacles);
  for (const TrueObstacle& o : obstacles)
    if (o.kind != "chair") out.offset_m = std::max(out.offset_m, offset_of(o, out.grid));
  if (auto judged = judge_map(builder.map(), recording, scene, method, out); !judged)
    return judged.error();
  if (auto sized = measure_files(builder, recording.folder(), out); !sized) return sized.error();
  return out;
}

Result<Scene> shipped_scene(const std::string& name) {
  return read_scene(CRANEMAP_SOURCE_DIR "/shared/sim/scenes/" + name + ".yaml");
}

Result<Recording> render(const Scene& scene, const std::string& folder) {
  SimulateOptions options;
  options.folder = folder;
  if (auto done = simulate(scene, options); !done) return done.error();
  return Recording::open(folder);
}

}  // namespace crane::accuracy
