// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "base/drop_counts.hpp"
#include "config/site_config.hpp"
#include "geometry/stereo_rig.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/epoch.hpp"
#include "mapping/forgetting.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/paper_mapper.hpp"
#include "mapping/projective_integrator.hpp"
#include "mapping_pipeline/cloud_queue.hpp"
#include "mapping_pipeline/gantry.hpp"
#include "mapping_pipeline/hoist_tracker.hpp"
#include "mapping_pipeline/position_trust.hpp"
#include "motion/motion_stereo.hpp"
#include "watchdog/watchdog.hpp"

namespace crane {

/// How long a step of the pipeline took.
struct StageMs {
  const char* stage;
  double ms;
};

/// What became of one frame.
struct FrameReport {
  std::uint64_t stream = 0, sequence_number = 0;
  TimeNs exposure_time = 0;
  std::optional<Cause> refused;                        ///< why it is not in the map; nothing: it is
  Eigen::Vector2d gantry_m = Eigen::Vector2d::Zero();  ///< where it was placed
  Eigen::Vector2d fits_better_m = Eigen::Vector2d::Zero();  ///< kContradictsMap: so much further
  MotionReport motion;
  SurfaceReport surfaces;
  std::vector<StageMs> stages;
};

/// What the pipeline says of itself, beside its map.
struct PipelineReport {
  FrameAccount account;                     ///< of the stream that is mapped
  DropCounts counts;                        ///< since the start
  HoistKnown hoist = HoistKnown::kNotUsed;  ///< at the last frame
  /// kLost because all hoist_state is of another time: the nearest is so much later; else 0.
  double hoist_apart_s = 0;
  Trust trust = Trust::kGood;
  double jump_m = 0;  ///< of the axis that jumped
  WatchState watch = WatchState::kFine;
  Misfit misfit;                 ///< why it is not
  std::optional<Cause> refused;  ///< why the last frame is not in the map; nothing: it is
  bool memory_full = false;      ///< what is new is not kept
  std::size_t waiting = 0;       ///< clouds that wait for their positions
  TimeNs last_arrival = 0;       ///< of a cloud
  TimeNs age = 0;                ///< of the map; see AgeClock
};

/// Clouds and positions in, map out. How one frame becomes map stands in map_frame(), top to
/// bottom. No DDS, no files, no log; the clock is the caller's. One thread.
class MappingPipeline {
 public:
  /// Error: Configuration when heights or positions lie where no tile can be.
  static Result<void> check(const MapperConfig& config, const StereoRig& rig);
  /// Of a configuration that passes check().
  MappingPipeline(const MapperConfig& config, const StereoRig& rig, const HoistConfig& hoist = {},
                  const WatchdogConfig& watchdog = {});

  // ------------------------------------------------------------------ In.

  /// `stream`: of the axis's readings; a new one starts with no positions known.
  void add_position(Axis axis, std::uint64_t stream, TimeNs time, double distance_m);
  /// A reading whose device says it failed: counted, never used.
  void add_failed_position(Axis axis);
  void add_hoist(const HoistReading& reading);
  void add_failed_hoist() { counts_.add(Cause::kHoistFailed); }
  void add_cloud(CloudSample cloud, TimeNs now);

  // ------------------------------------------------------------------ A frame becomes map.

  /// The oldest waiting cloud: into the map if its positions are known, or given up when they
  /// cannot come any more. Nothing when none waits, or it waits on.
  std::optional<FrameReport> step(TimeNs now);
  /// Lets the map grow older while no frame comes; to be called at least every second.
  void rest(TimeNs now);

  // ------------------------------------------------------------------ Out.

  [[nodiscard]] OccupancyMap& map() { return *map_; }
  [[nodiscard]] const OccupancyMap& map() const { return *map_; }
  [[nodiscard]] PipelineReport report() const;
  [[nodiscard]] const Watchdog& watchdog() const { return watchdog_; }
  [[nodiscard]] TimeNs last_arrival() const { return last_arrival_; }
  [[nodiscard]] const FrameAccount& account() const { return queue_.account(); }
  /// The voxel size in use: as configured, 0.1 D for the paper's method (eq. 9), else 0.05 m.
  [[nodiscard]] double voxel_m() const { return map_->voxel_m(); }
  /// Where the rope ends, or the map when that is lower: MapStatus.ceiling_m.
  [[nodiscard]] double ceiling_m() const { return ceiling_m_; }

  // ------------------------------------------------------------------ The paper's method.

  /// method: paper makes the map anew from all clouds. Error: what a filter says.
  Result<std::vector<StageMs>> rebuild();
  [[nodiscard]] bool needs_rebuild() const { return paper_ && stale_; }
  [[nodiscard]] const PointCloud* paper_cloud() const {
    return paper_ ? &paper_->filtered() : nullptr;
  }

  // ------------------------------------------------------------------ A map from elsewhere.

  /// Begins anew with nothing.
  void clear();
  /// Goes on with a map that was kept.
  void restore(const FrameAccount& account, TimeNs age);
  /// How far the serving mapper is, for its standby. Before the tiles that it published then.
  void adopt(const FrameAccount& account, HoistKnown hoist, TimeNs now);
  /// One of its tiles, in place of what is here.
  void adopt(TileKey key, const std::map<int, BlockClasses>& blocks, const TileHeights& heights);

 private:
  /// How long a cloud waits that cannot be placed. What a player sends again until it is accounted
  /// for waits longer, unless the cloud before it did so in vain.
  [[nodiscard]] TimeNs patience(const CloudSample& cloud, const Gantry::Place& place) const;
  [[nodiscard]] bool waits_for_hoist(const CloudSample& cloud, TimeNs now) const;
  FrameReport map_frame(CloudSample& cloud, const Gantry::Place& place, TimeNs now);
  [[nodiscard]] Eigen::Isometry3d T_map_rectified(const CloudSample& cloud,
                                                  const Gantry::Place& place) const;
  std::optional<Cause> disagrees_with_calibration(const CloudSample& cloud,
                                                  const Gantry::Place& place);
  [[nodiscard]] Eigen::Vector2d speed_mps(TimeNs exposure, const Eigen::Vector2d& place_m) const;
  void cut_out_hoist(CloudSample& cloud, const Eigen::Vector2d& gantry_m);
  [[nodiscard]] bool full() const;
  std::optional<Cause> integrate(const CloudSample& cloud, FrameReport& report);

  MapperConfig config_;
  StereoRig rig_;
  double ceiling_m_;
  std::uint64_t calibration_;  ///< digest of the rig
  CloudQueue queue_;
  Gantry gantry_;
  PositionTrust positions_;
  bool watched_;
  Watchdog watchdog_;
  HoistTracker hoist_;
  MotionStereo motion_;
  HoistKnown hoist_known_;
  double hoist_apart_s_ = 0;
  ProjectiveIntegrator integrator_;
  std::unique_ptr<OccupancyMap> map_;
  AgeClock ages_;
  Forgetting forgetting_;
  std::optional<PaperMapper> paper_;
  bool stale_ = false;  ///< paper: clouds came since the map was made
  DropCounts counts_;
  TimeNs last_arrival_ = 0;
  std::optional<Cause> last_refused_;
  bool gave_up_ = false;  ///< the last cloud had no position
};

}  // namespace crane
