// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/site_config.hpp"
#include "cranemap/obstacle_heights.hpp"
#include "evaluation/evaluation.hpp"
#include "mapping/occupancy_map.hpp"
#include "recording/recording.hpp"
#include "sim/scene.hpp"
#include "stereo/stereo_stage.hpp"

namespace crane::accuracy {

/// One way from images to a map.
struct Method {
  StereoSettings stereo;
  MapperConfig mapper;
  HoistConfig hoist;
  /// Told of the map after each frame.
  std::function<void(std::size_t frame, const OccupancyMap& map)> watch;
  bool nearest_position = false;  ///< the rangefinders' nearest reading, not interpolated
  bool free_precision = true;     ///< judge every free voxel too
  std::size_t queries = 0;        ///< random clearance queries against the truth
  bool voxel_tops = false;        ///< heights as they are read off an octree: tops of voxels
};

Method cranemap_method(double voxel_m);
/// Zhao et al. 2021: block matching, outlier removal, voxel grid, octree.
Method paper_method(double voxel_m, int outlier_neighbours = 50, double outlier_std = 1.0);

/// What one recording became, against its truth.
struct Outcome {
  std::vector<ObstacleHeight> heights;
  Judgement judgement;  ///< by columns
  CellJudgement cells;
  ClearanceTrial clearance;
  std::uint64_t free_voxels = 0;
  double free_precision = 1;  ///< share of them whose centre is not inside anything
  std::size_t frames = 0;     ///< in the map
  double cloud_ms = 0;        ///< rectify, match, reproject: mean of a frame
  double update_ms = 0;       ///< clouds to published map: mean of an update
  std::size_t pcd_bytes = 0, ot_bytes = 0, bt_bytes = 0;
  client::HeightGrid grid;
  std::vector<MapCube> occupied;
  /// How far the middle of an obstacle's top lies from where it is, largest of all; chairs apart.
  double offset_m = 0;

  [[nodiscard]] double worst_percent() const;
  [[nodiscard]] double mean_percent() const;
};

/// Plays `recording`, a rendering of `scene`, through the stages themselves, without DDS.
Result<Outcome> run_trial(const Recording& recording, const Scene& scene, const Method& method);

/// A scene that ships with the sources.
Result<Scene> shipped_scene(const std::string& name);
/// Renders into `folder`, which must be new, and opens the recording.
Result<Recording> render(const Scene& scene, const std::string& folder);

}  // namespace crane::accuracy
