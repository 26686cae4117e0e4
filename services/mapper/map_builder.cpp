#include "mapper/map_builder.hpp"

#include "map_codec/tile_adopt.hpp"
#include "mapping/hoist_mask.hpp"

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

std::size_t bytes(const MapperConfig& c) {
  return std::size_t(c.max_memory_mib) << 20U;
}

IntegratorSettings heights(const MapperConfig& c, const StereoRig& rig) {
  return {c.z_min_m, c.z_max_m > 0 ? c.z_max_m : rig.camera_height_m() - 0.1};
}

PositionTrack make_track(const MapperConfig& c) {
  return {c.rangefinder_min_m, c.rangefinder_max_m,
          std::chrono::milliseconds(c.max_position_gap_ms)};
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

}  // namespace

Result<void> MapBuilder::check(const MapperConfig& config, const StereoRig& rig) {
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
      4 * rig.camera_height_m();
  if (position / voxel > kPositions) return too_far("a position", position, kPositions);
  return {};
}

MapBuilder::MapBuilder(const MapperConfig& config, const StereoRig& rig, const HoistConfig& hoist)
    : config_(config),
      rig_(rig),
      map_(std::make_unique<OccupancyMap>(choose_voxel(config, rig), bytes(config))),
      integrator_(heights(config, rig)),
      paper_(make_paper(config)),
      cart_(make_track(config)),
      trolley_(make_track(config)),
      hoist_(hoist, rig.camera_height_m()),
      hoist_known_(hoist.enabled ? HoistKnown::kLost : HoistKnown::kNotUsed),
      forgetting_(config.method == MapperConfig::Method::kPaper ? 0 : config.forget_s) {}

void MapBuilder::restore(const FrameAccount& account, TimeNs age) {
  account_ = account;
  ages_.restore(age, account.last_frame_time);
}

void MapBuilder::clear() {
  map_ = std::make_unique<OccupancyMap>(map_->voxel_m(), bytes(config_));
  account_ = FrameAccount{};
  ages_ = AgeClock{};
}

void MapBuilder::adopt(const FrameAccount& account, HoistKnown hoist, TimeNs now) {
  hoist_known_ = hoist;
  if (account.last_frame_time == account_.last_frame_time && account.stream == account_.stream)
    return;
  account_ = account;
  last_arrival_ = now;
  // What is adopted may be as old as a map remembers.
  const TimeNs remembered = TimeNs(2e9 * std::max(1.0, config_.forget_s));
  if (ages_.time() == 0) ages_.restore(remembered, account.last_frame_time);
  ages_.at_exposure(account.last_frame_time, now);
  forgetting_.advance(ages_.time(), *map_);
}

void MapBuilder::adopt(TileKey key, const std::map<int, BlockClasses>& blocks,
                       const TileHeights& heights) {
  const TimeNs now = ages_.time();
  const TimeNs oldest = now - TimeNs(0.98e9 * config_.forget_s);  // older is said to be stale
  const auto epoch_of = [&](TimeNs seen) {
    const TimeNs age = seen == 0 ? now : ages_.of_exposure(seen);
    return forgetting_.epoch_at(std::clamp(age, oldest, now));
  };
  adopt_tile(key, blocks, heights, epoch_of, *map_);
}

void MapBuilder::rest(TimeNs now) {
  ages_.at_rest(now);
  forgetting_.advance(ages_.time(), *map_);
}

void MapBuilder::add_position(Axis axis, std::uint64_t stream, TimeNs time, double distance_m) {
  if (stream != position_stream_) {  // another recording may use the same times for other places
    position_stream_ = stream;
    cart_.clear();
    trolley_.clear();
  }
  const bool cart = axis == Axis::kCart;
  const TimeNs latency =
      TimeNs(cart ? config_.cart_latency_ms : config_.trolley_latency_ms) * 1'000'000;
  const std::string name = cart ? "cart " : "trolley ";
  switch ((cart ? cart_ : trolley_).add(time - latency, distance_m)) {
    case PositionTrack::Added::kYes:
    case PositionTrack::Added::kOutOfOrder:  // sent again by a player: known already
      break;
    case PositionTrack::Added::kNotFinite:
      dropped.add(name + "reading not finite");
      break;
    case PositionTrack::Added::kOutOfRange:
      dropped.add(name + "reading out of range");
      break;
  }
}

void MapBuilder::add_failed_position(Axis axis) {
  dropped.add(axis == Axis::kCart ? "cart reading failed" : "trolley reading failed");
}

void MapBuilder::add_cloud(CloudSample cloud, TimeNs now) {
  last_arrival_ = now;
  if (cloud.stream != account_.stream) {
    account_ = FrameAccount{};
    account_.stream = cloud.stream;
    newest_queued_ = -1;
    pending_.clear();
  }
  const auto number = static_cast<std::int64_t>(cloud.sequence_number);
  if (number <= std::max(account_.last_frame, newest_queued_)) return;  // sent again: known already
  if (cloud.after > std::max(account_.last_frame, newest_queued_)) {
    dropped.add("came before an earlier cloud: is sent again");
    return;
  }
  newest_queued_ = number;
  cloud.arrival_time = now;
  if (pending_.size() == kMaxPending) {
    dropped.add("cloud queue full");
    account_for(pending_.front(), false);
    pending_.pop_front();
  }
  pending_.push_back(std::move(cloud));
}

MapBuilder::Placing MapBuilder::place(CloudSample& cloud, TimeNs now) {
  double cart_m = 0;
  double trolley_m = 0;
  const auto cart = cart_.at(cloud.exposure_time, cart_m);
  const auto trolley = trolley_.at(cloud.exposure_time, trolley_m);
  using Lookup = PositionTrack::Lookup;
  if (cart == Lookup::kGap || trolley == Lookup::kGap) return Placing::kGap;
  if (cart == Lookup::kNotYet || trolley == Lookup::kNotYet) return Placing::kWait;
  // Hook and load may have moved until the exposure: their next state is waited for, but not long.
  if (hoist_.used() && !hoist_.reaches(cloud.exposure_time) &&
      hoist_.known_at(cloud.exposure_time) == HoistKnown::kLost &&
      now - cloud.arrival_time < hoist_.max_gap())
    return Placing::kWait;
  cloud.gantry_m = {cart_m, trolley_m};
  // eq. 5-7: translation only; the mount's tilt and height come from the calibration.
  Eigen::Isometry3d T_left_rectified = Eigen::Isometry3d::Identity();
  T_left_rectified.linear() = cloud.R_camera_rectified;
  cloud.frame.T_map_rectified =
      Eigen::Translation3d(cart_m, trolley_m, 0) * rig_.T_map_camera_at_zero * T_left_rectified;
  return Placing::kPlaced;
}

TimeNs MapBuilder::patience(const CloudSample& cloud, Placing placing) const {
  const TimeNs live = placing == Placing::kWait ? TimeNs(config_.position_wait_ms) * 1'000'000 : 0;
  const bool sent_again = cloud.after >= 0;
  return sent_again && !gave_up_ ? std::max(live, kReplayPatience) : live;
}

bool MapBuilder::step(TimeNs now) {
  if (pending_.empty()) return false;
  CloudSample& cloud = pending_.front();
  const Placing placing = place(cloud, now);
  if (placing != Placing::kPlaced) {
    if (now - cloud.arrival_time < patience(cloud, placing)) return false;
    dropped.add(placing == Placing::kWait ? "no position: none arrived after the exposure"
                                          : "no position: gap around the exposure");
    gave_up_ = true;
    account_for(cloud, false);
  } else {
    gave_up_ = false;
    ages_.at_exposure(cloud.exposure_time, now);
    forgetting_.advance(ages_.time(), *map_);
    cut_out_hoist(cloud);
    integrate(cloud);
  }
  pending_.pop_front();
  return true;
}

void MapBuilder::cut_out_hoist(CloudSample& cloud) {
  if (!hoist_.used()) return;
  const Stopwatch watch;
  hoist_.prove(cart_, trolley_, *map_);
  hoist_known_ = hoist_.known_at(cloud.exposure_time);
  if (hoist_known_ == HoistKnown::kLost) dropped.add("frame without hoist_state: cut out widely");
  cut_out_ += mask_bodies(hoist_.bodies_at(cloud.exposure_time, cloud.gantry_m), cloud.frame,
                          cloud.depth_m);
  dropped.set("pixels of hook, rope and load", cut_out_);
  stages.add("cut out hoist", watch.ms());
}

void MapBuilder::integrate(CloudSample& cloud) {
  const Stopwatch watch;
  cloud.frame.depth_m = cloud.depth_m.data();
  cloud.frame.confidence = cloud.confidence.data();
  cloud.frame.colour = cloud.colour.empty() ? nullptr : cloud.colour.data();
  if (paper_) {
    const Result<void> added = paper_->add(cloud.frame, cloud.exposure_time);
    if (!added) dropped.add("paper: point limit reached");
    stale_ = true;
    account_for(cloud, added.ok());
  } else {
    const IntegrationReport report = integrator_.integrate(cloud.frame, cloud.exposure_time, *map_);
    if (report.surfaces.points == 0) dropped.add("cloud without a single match");
    dropped.set("points outside z_min..z_max", dropped_points_ += report.surfaces.out_of_range);
    dropped.set("blocks beyond max_memory_mib", map_->refused_blocks());
    account_for(cloud, report.surfaces.points > 0);
  }
  stages.add("integrate", watch.ms());
}

void MapBuilder::account_for(const CloudSample& cloud, bool integrated) {
  const auto number = static_cast<std::int64_t>(cloud.sequence_number);
  const std::int64_t gap = number - account_.last_frame - 1;
  if (gap > 0) {
    account_.missing += static_cast<std::uint64_t>(gap);
    dropped.add("cloud never arrived", static_cast<std::uint64_t>(gap));
  }
  account_.last_frame = number;
  account_.last_frame_time = cloud.exposure_time;
  account_.last_frame_sent = cloud.sent_time;
  ++(integrated ? account_.integrated : account_.rejected);
}

Result<void> MapBuilder::rebuild() {
  if (!needs_rebuild()) return {};
  auto fresh = std::make_unique<OccupancyMap>(map_->voxel_m(), bytes(config_));
  const auto report = paper_->build(*fresh);
  if (!report) return report.error();
  stages.add("paper: voxel grid", report->grid_ms);
  stages.add("paper: outlier removal", report->outliers_ms);
  stages.add("paper: octree", report->octree_ms);
  stages.add("paper: filter and octree", report->grid_ms + report->outliers_ms + report->octree_ms);
  // A tile that the filters emptied is published as an empty one.
  for (const Tile* old : map_->tiles()) {
    Tile& tile = fresh->tile(old->key);
    tile.reclassified = true;
    fresh->mark_changed(tile);
  }
  map_ = std::move(fresh);
  stale_ = false;
  return {};
}

}  // namespace crane
