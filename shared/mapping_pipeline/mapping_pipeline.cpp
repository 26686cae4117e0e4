// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/mapping_pipeline.hpp"

#include <cmath>
#include <exception>
#include <numbers>

#include "geometry/calibration_digest.hpp"
#include "map_codec/tile_adopt.hpp"
#include "mapping/hoist_mask.hpp"
#include "mapping_pipeline/cloud_check.hpp"

namespace crane {
namespace {

constexpr double kDefaultVoxel = 0.05;
/// Positions that a player lost are sent again after 1.5 s; a killed neighbour can hold them up.
constexpr TimeNs kReplayPatience = 6 * kNsPerSecond;

double choose_voxel(const MapperConfig& c, const StereoRig& rig) {
  if (c.voxel_m > 0) return c.voxel_m;
  return c.method == MapperConfig::Method::kPaper ? paper_voxel_m(rig.camera_height_m())
                                                  : kDefaultVoxel;
}

WatchdogLimits limits_of(const WatchdogConfig& c) {
  constexpr double kDegree = std::numbers::pi / 180;
  WatchdogLimits l;
  l.height_share = {c.height_drifting_percent / 100, c.height_wrong_percent / 100};
  l.tilt_rad = {c.tilt_drifting_deg * kDegree, c.tilt_wrong_deg * kDegree};
  l.row_offset_px = {c.rows_drifting_px, c.rows_wrong_px};
  l.roll_rad = {c.roll_drifting_deg * kDegree, c.roll_wrong_deg * kDegree};
  l.scale_share = {c.scale_drifting_percent / 100, c.scale_wrong_percent / 100};
  l.turn_rad = {c.turn_drifting_deg * kDegree, c.turn_wrong_deg * kDegree};
  l.delay_s = {c.delay_drifting_ms / 1000, c.delay_wrong_ms / 1000};
  l.jump_m = c.jump_m;
  return l;
}

std::size_t bytes(const MapperConfig& c) {
  return std::size_t(c.max_memory_mib) << 20U;
}

IntegratorSettings heights(const MapperConfig& c, const StereoRig& rig) {
  return {c.z_min_m, c.z_max_m > 0 ? c.z_max_m : rig.camera_height_m() - 0.1, false, c.threads};
}

double ceiling(const MapperConfig& c, const HoistConfig& hoist, const StereoRig& rig) {
  const double rope = hoist.rope_top_m > 0 ? hoist.rope_top_m : rig.camera_height_m();
  return std::max(0.0, std::min(rope, heights(c, rig).z_max_m));
}

std::optional<PaperMapper> make_paper(const MapperConfig& c) {
  if (c.method != MapperConfig::Method::kPaper) return std::nullopt;
  PaperSettings s;
  s.outlier_neighbours = c.outlier_neighbours;
  s.outlier_std = c.outlier_std;
  s.leaf_m = c.leaf_m;
  s.outliers_first = c.outliers_first;
  s.max_points = bytes(c) / sizeof(Point);
  return PaperMapper(s);
}

/// Of the grid on which frames are compared: the camera sees about a hundred along its longer side.
double cell_m(const StereoRig& rig) {
  const double seen_m =
      rig.camera_height_m() * double(rig.left.width) / std::max(1.0, rig.left.fx_px);
  return std::max(seen_m / 100, 0.01);
}

}  // namespace

Result<void> MappingPipeline::check(const MapperConfig& config, const StereoRig& rig) {
  const IntegratorSettings range = heights(config, rig);
  const double voxel = choose_voxel(config, rig);
  const auto too_far = [voxel](const char* what, double metres, int indices) {
    return Error{ErrorCode::kConfiguration, "mapper.voxel_m",
                 "at " + std::to_string(voxel) + " m, " + what + " of " + std::to_string(metres) +
                     " m lies beyond the " + std::to_string(indices) + " voxels that tiles reach",
                 "raise it, or lower what is too far"};
  };
  constexpr int kHeights = kHighestBlock * kTileEdge;
  constexpr int kPositions = kFarthestTile * kTileEdge;
  const double height = std::max(std::abs(range.z_min_m), std::abs(range.z_max_m));
  if (height / voxel > kHeights) return too_far("a height", height, kHeights);
  // What is seen lies hardly farther from the trolley than the camera is high.
  const double position =
      std::max(std::abs(config.rangefinder_min_m), std::abs(config.rangefinder_max_m)) +
      std::max(std::abs(config.cart_offset_m), std::abs(config.trolley_offset_m)) +
      4 * rig.camera_height_m();
  if (position / voxel > kPositions) return too_far("a position", position, kPositions);
  return {};
}

MappingPipeline::MappingPipeline(const MapperConfig& config, const StereoRig& rig,
                                 const HoistConfig& hoist, const WatchdogConfig& watchdog)
    : config_(config),
      rig_(rig),
      ceiling_m_(ceiling(config, hoist, rig)),
      calibration_(calibration_digest(rig)),
      gantry_(config),
      positions_(cell_m(rig)),
      watched_(watchdog.enabled && config.method != MapperConfig::Method::kPaper),
      watchdog_(limits_of(watchdog), rig.camera_height_m(), rig.T_left_right.translation().norm()),
      hoist_(hoist, rig.camera_height_m()),
      motion_(config.threads),
      hoist_known_(hoist.enabled ? HoistKnown::kLost : HoistKnown::kNotUsed),
      integrator_(heights(config, rig)),
      map_(std::make_unique<OccupancyMap>(choose_voxel(config, rig), bytes(config))),
      forgetting_(config.method == MapperConfig::Method::kPaper ? 0 : config.forget_s),
      paper_(make_paper(config)) {}

// ------------------------------------------------------------------ In.

void MappingPipeline::add_position(Axis axis, std::uint64_t stream, TimeNs time,
                                   double distance_m) {
  if (const auto refused = gantry_.add(axis, stream, time, distance_m)) counts_.add(*refused);
}

void MappingPipeline::add_failed_position(Axis axis) {
  counts_.add(axis == Axis::kTrolley ? Cause::kTrolleyFailed : Cause::kCartFailed);
}

void MappingPipeline::add_hoist(const HoistReading& reading) {
  if (!hoist_.add(reading)) counts_.add(Cause::kLoadTooLarge);
}

void MappingPipeline::add_cloud(CloudSample cloud, TimeNs now) {
  last_arrival_ = now;
  if (cloud.stream != account().stream) {
    positions_.begin_anew();  // its times are others
    motion_.begin_anew();
    watchdog_.begin_anew();
  }
  queue_.add(std::move(cloud), now, counts_);
}

// ------------------------------------------------------------------ A frame becomes map.

std::optional<FrameReport> MappingPipeline::step(TimeNs now) {
  using Lookup = PositionTrack::Lookup;
  if (queue_.empty()) return std::nullopt;
  CloudSample& cloud = queue_.oldest();
  const Gantry::Place place = gantry_.at(cloud.exposure_time);
  FrameReport report;
  if (place.known == Lookup::kNotYet || place.known == Lookup::kGap) {
    if (now - cloud.arrival_time < patience(cloud, place)) return std::nullopt;
    report.refused = place.known == Lookup::kNotYet ? Cause::kPositionNone : Cause::kPositionGap;
    gave_up_ = true;
  } else if (const auto flaw = check_cloud(cloud, calibration_)) {
    report.refused = flaw;
  } else if (place.known == Lookup::kDoubtful) {
    report.refused = Cause::kPositionDoubtful;
  } else if (waits_for_hoist(cloud, now)) {
    return std::nullopt;
  } else {
    gave_up_ = false;
    report = map_frame(cloud, place, now);
  }
  report.stream = cloud.stream;
  report.sequence_number = cloud.sequence_number;
  report.exposure_time = cloud.exposure_time;
  if (report.refused) counts_.add(*report.refused);
  last_refused_ = report.refused;
  queue_.done(!report.refused, counts_);
  return report;
}

TimeNs MappingPipeline::patience(const CloudSample& cloud, const Gantry::Place& place) const {
  const TimeNs live = place.known == PositionTrack::Lookup::kNotYet
                          ? TimeNs(config_.position_wait_ms) * 1'000'000
                          : 0;
  const bool sent_again = cloud.after >= 0;
  return sent_again && !gave_up_ ? std::max(live, kReplayPatience) : live;
}

/// Hook and load may have moved until the exposure: their next state is waited for, but not long.
bool MappingPipeline::waits_for_hoist(const CloudSample& cloud, TimeNs now) const {
  return hoist_.used() && !hoist_.reaches(cloud.exposure_time) &&
         hoist_.known_at(cloud.exposure_time) == HoistKnown::kLost &&
         now - cloud.arrival_time < hoist_.max_gap();
}

FrameReport MappingPipeline::map_frame(CloudSample& cloud, const Gantry::Place& place, TimeNs now) {
  FrameReport report;
  const Stopwatch watch;
  double before_ms = 0;
  const auto lap = [&](const char* stage) {
    const double now_ms = watch.ms();
    report.stages.push_back({stage, now_ms - before_ms});
    before_ms = now_ms;
  };
  ages_.at_exposure(cloud.exposure_time, now);
  forgetting_.advance(ages_.time(), *map_);

  // 1. Placed by the positions interpolated to its exposure (eq. 5-7).
  report.gantry_m = place.map_m;
  cloud.frame.depth_m = cloud.depth_m.data();
  cloud.frame.confidence = cloud.confidence.data();
  cloud.frame.colour = cloud.colour.empty() ? nullptr : cloud.colour.data();
  cloud.frame.T_map_rectified = T_map_rectified(cloud, place);

  // 2. What is rope, hook or load is no workshop.
  if (hoist_.used()) {
    cut_out_hoist(cloud, place.map_m);
    lap("cut out hoist");
  }

  // 3. Watched: do floor, rows and the way in the images agree with calibration and positions?
  const auto disagrees = [&]() -> std::optional<Cause> {
    const std::optional<Cause> cause = disagrees_with_calibration(cloud, place);
    lap("watch");
    if (cause) hoist_.prove_nothing();
    return cause;
  };
  if (watched_) watchdog_.see_rows(cloud.rows);
  const bool confirmed = place.known == PositionTrack::Lookup::kFound;
  if (confirmed)
    if (report.refused = disagrees(); report.refused) return report;

  // 4. Checked: does it see here what was seen here before?
  const PositionTrust::Finding found = positions_.check(cloud.frame, cloud.exposure_time, place);
  lap("check placement");
  if (found.refused) {
    report.refused = found.refused;
    report.fits_better_m = found.fits_better_m;
    hoist_.prove_nothing();
    return report;
  }
  // Positions that nothing had confirmed are not what a calibration is judged by.
  if (!confirmed)
    if (report.refused = disagrees(); report.refused) return report;
  gantry_.trust(cloud.exposure_time);
  hoist_.prove(gantry_, *map_);

  // 5. What the pair left without a match, by the crane's own motion.
  if (!paper_) {
    report.motion = motion_.improve(cloud.frame, cloud.exposure_time, cloud.depth_m,
                                    cloud.confidence, cloud.ambiguous_m);
    counts_.add(Cause::kEarlierFrameMisplaced, report.motion.misplaced);
    lap("motion stereo");
  }

  // 6. Surfaces found and put in, space before them freed.
  report.refused = integrate(cloud, report);
  lap("integrate");
  return report;
}

Eigen::Isometry3d MappingPipeline::T_map_rectified(const CloudSample& cloud,
                                                   const Gantry::Place& place) const {
  // Translation, and what the bridge is skew; the mount's tilt and height come from the
  // calibration.
  Eigen::Isometry3d T_left_rectified = Eigen::Isometry3d::Identity();
  T_left_rectified.linear() = cloud.R_camera_rectified;
  return Eigen::Translation3d(place.map_m.x(), place.map_m.y(), 0) *
         Eigen::AngleAxisd(place.skew_rad, Eigen::Vector3d::UnitZ()) * rig_.T_map_camera_at_zero *
         T_left_rectified;
}

std::optional<Cause> MappingPipeline::disagrees_with_calibration(const CloudSample& cloud,
                                                                 const Gantry::Place& place) {
  if (!watched_ || watchdog_.look(cloud.frame, {cloud.exposure_time, place.map_m,
                                                speed_mps(cloud.exposure_time, place.map_m)}))
    return std::nullopt;
  return watchdog_.state() == WatchState::kWrong ? Cause::kWatchdogWrong : Cause::kImageContradicts;
}

/// By the rangefinders, just before the exposure.
Eigen::Vector2d MappingPipeline::speed_mps(TimeNs exposure, const Eigen::Vector2d& place_m) const {
  constexpr TimeNs kBefore = 80'000'000;
  const Gantry::Place before = gantry_.at(exposure - kBefore);
  if (before.known != PositionTrack::Lookup::kFound) return Eigen::Vector2d::Zero();
  return (place_m - before.map_m) / (double(kBefore) * 1e-9);
}

void MappingPipeline::cut_out_hoist(CloudSample& cloud, const Eigen::Vector2d& gantry_m) {
  hoist_known_ = hoist_.known_at(cloud.exposure_time);
  hoist_apart_s_ = 0;
  if (hoist_known_ == HoistKnown::kLost) {
    const std::optional<TimeNs> apart = hoist_.apart(cloud.exposure_time);
    if (apart) hoist_apart_s_ = double(*apart) * 1e-9;
    counts_.add(apart ? Cause::kHoistOfAnotherTime : Cause::kHoistUnknown);
  }
  counts_.add(Cause::kHoistPixels, mask_bodies(hoist_.bodies_at(cloud.exposure_time, gantry_m),
                                               cloud.frame, cloud.depth_m));
}

/// No room for another tile and what is in it.
bool MappingPipeline::full() const {
  return map_->memory_bytes() + sizeof(Tile) + sizeof(Block) > bytes(config_);
}

std::optional<Cause> MappingPipeline::integrate(const CloudSample& cloud, FrameReport& report) {
  if (paper_) {
    stale_ = true;
    if (!paper_->add(cloud.frame, cloud.exposure_time)) return Cause::kPaperPoints;
    return std::nullopt;
  }
  if (full()) return Cause::kMapFull;
  try {
    report.surfaces = integrator_.integrate(cloud.frame, cloud.exposure_time, *map_).surfaces;
  } catch (const std::exception&) {  // memory: what was put in so far stays
    return Cause::kIntegrationFailed;
  }
  counts_.add(Cause::kPointsOutsideHeights, report.surfaces.out_of_range);
  counts_.set(Cause::kMapMemory, map_->refused_blocks());
  if (report.surfaces.points == 0) return Cause::kNoMatch;
  return std::nullopt;
}

void MappingPipeline::rest(TimeNs now) {
  ages_.at_rest(now);
  forgetting_.advance(ages_.time(), *map_);
}

// ------------------------------------------------------------------ Out.

PipelineReport MappingPipeline::report() const {
  PipelineReport r;
  r.account = account();
  r.counts = counts_;
  r.hoist = hoist_known_;
  r.hoist_apart_s = hoist_apart_s_;
  r.refused = last_refused_;
  r.waiting = queue_.size();
  r.last_arrival = last_arrival_;
  r.age = ages_.time();
  r.memory_full = map_->refused_blocks() > 0 || full();
  r.trust = positions_.trust();
  r.watch = watchdog_.state();
  r.misfit = watchdog_.worst();
  for (const Axis axis : {Axis::kCart, Axis::kTrolley, Axis::kCartSecond})
    if (r.trust == Trust::kGood && !gantry_.trusted(axis)) {
      r.trust = axis == Axis::kTrolley ? Trust::kTrolleyJumped : Trust::kCartJumped;
      r.jump_m = gantry_.jump_m(axis);
    }
  return r;
}

// ------------------------------------------------------------------ The paper's method.

Result<std::vector<StageMs>> MappingPipeline::rebuild() {
  if (!needs_rebuild()) return std::vector<StageMs>{};
  auto fresh = std::make_unique<OccupancyMap>(map_->voxel_m(), bytes(config_));
  const auto report = paper_->build(*fresh);
  if (!report) return report.error();
  // A tile that the filters emptied is published as an empty one.
  for (const Tile* old : map_->tiles()) {
    Tile* tile = fresh->tile_if_room(old->key);
    if (tile == nullptr) continue;  // counted by the map, which is said to be full
    tile->reclassified = true;
    fresh->mark_changed(*tile);
  }
  map_ = std::move(fresh);
  stale_ = false;
  return std::vector<StageMs>{
      {"paper: voxel grid", report->grid_ms},
      {"paper: outlier removal", report->outliers_ms},
      {"paper: octree", report->octree_ms},
      {"paper: filter and octree", report->grid_ms + report->outliers_ms + report->octree_ms}};
}

// ------------------------------------------------------------------ A map from elsewhere.

void MappingPipeline::restore(const FrameAccount& account, TimeNs age) {
  queue_.restore(account);
  ages_.restore(age, account.last_frame_time);
}

void MappingPipeline::clear() {
  map_ = std::make_unique<OccupancyMap>(map_->voxel_m(), bytes(config_));
  queue_.restore({});
  ages_ = AgeClock{};
  positions_.begin_anew();
  motion_.begin_anew();
}

void MappingPipeline::adopt(const FrameAccount& account, HoistKnown hoist, TimeNs now) {
  hoist_known_ = hoist;
  hoist_apart_s_ = 0;
  const FrameAccount& ours = queue_.account();
  if (account.last_frame_time == ours.last_frame_time && account.stream == ours.stream) return;
  queue_.restore(account);
  last_arrival_ = now;
  // What is adopted may be as old as a map remembers.
  const TimeNs remembered = TimeNs(2e9 * std::max(1.0, config_.forget_s));
  if (ages_.time() == 0) ages_.restore(remembered, account.last_frame_time);
  ages_.at_exposure(account.last_frame_time, now);
  forgetting_.advance(ages_.time(), *map_);
}

void MappingPipeline::adopt(TileKey key, const std::map<int, BlockClasses>& blocks,
                            const TileHeights& heights) {
  const TimeNs now = ages_.time();
  const TimeNs oldest = now - TimeNs(0.98e9 * config_.forget_s);  // older is said to be stale
  const auto epoch_of = [&](TimeNs seen) {
    const TimeNs age = seen == 0 ? now : ages_.of_exposure(seen);
    return forgetting_.epoch_at(std::clamp(age, oldest, now));
  };
  adopt_tile(key, blocks, heights, epoch_of, *map_);
}

}  // namespace crane
