#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "base/stage_times.hpp"
#include "config/site_config.hpp"
#include "geometry/position_track.hpp"
#include "geometry/stereo_rig.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapper/hoist_tracker.hpp"
#include "mapping/epoch.hpp"
#include "mapping/forgetting.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/paper_mapper.hpp"
#include "mapping/projective_integrator.hpp"

namespace crane {

/// One organised cloud with memory of its own.
struct CloudSample {
  std::uint64_t stream = 0, sequence_number = 0;
  std::int64_t after = -1;  ///< frame that must have been accounted for; -1 = none
  TimeNs exposure_time = 0;
  TimeNs arrival_time = 0;
  TimeNs sent_time = 0;  ///< when the camera handed its frame on, wall clock
  DepthFrame frame;      ///< points into the vectors below
  Eigen::Vector2d gantry_m = Eigen::Vector2d::Zero();  ///< cart and trolley, once placed
  Eigen::Matrix3d R_camera_rectified = Eigen::Matrix3d::Identity();
  std::vector<float> depth_m;
  std::vector<std::uint8_t> confidence, colour;
};

/// Which frames of a stream are in the map, and what became of the others.
struct FrameAccount {
  std::uint64_t stream = 0;
  std::int64_t last_frame = -1;  ///< sequence number accounted for; -1 = none
  TimeNs last_frame_time = 0;
  TimeNs last_frame_sent = 0;    ///< wall clock
  std::uint64_t integrated = 0;  ///< in the map
  std::uint64_t rejected = 0;    ///< arrived, but could not be used
  std::uint64_t missing = 0;     ///< never arrived
};

enum class Axis { kCart, kTrolley };

/// Places clouds by rangefinder positions interpolated to their exposure and adds them to the map.
/// No DDS, no files; the clock is the caller's. One thread.
class MapBuilder {
 public:
  /// Clouds that wait for their positions; the oldest is given up when one more comes.
  static constexpr std::size_t kMaxPending = 8;

  /// Error: Configuration when heights or positions lie where no tile can be.
  static Result<void> check(const MapperConfig& config, const StereoRig& rig);
  /// Of a configuration that passes check().
  MapBuilder(const MapperConfig& config, const StereoRig& rig, const HoistConfig& hoist = {});

  /// The voxel size in use: as configured, 0.1 D for the paper's method (eq. 9), else 0.05 m.
  [[nodiscard]] double voxel_m() const { return map_->voxel_m(); }
  /// Where the rope ends, or the map when that is lower: MapStatus.ceiling_m.
  [[nodiscard]] double ceiling_m() const { return ceiling_m_; }

  /// `stream`: of the readings; a new one starts with no positions known.
  void add_position(Axis axis, std::uint64_t stream, TimeNs time, double distance_m);
  /// A reading whose device says it failed: counted, never used.
  void add_failed_position(Axis axis);
  void add_hoist(const HoistReading& reading) {
    if (!hoist_.add(reading)) dropped.add("hoist_state: load larger than hoist.largest_load_m");
  }
  void add_failed_hoist() { dropped.add("hoist_state says failed"); }
  void add_cloud(CloudSample cloud, TimeNs now);
  /// Integrates the oldest waiting cloud if its positions are known, or gives it up when they
  /// cannot come any more. True when a frame was accounted for.
  bool step(TimeNs now);
  /// Lets the map grow older while no frame comes; to be called at least every second.
  void rest(TimeNs now);

  /// method: paper makes the map anew from all clouds. Error: what a filter says.
  Result<void> rebuild();
  [[nodiscard]] bool needs_rebuild() const { return paper_ && stale_; }

  // A standby's map is that of the mapper that serves, as it is published.

  /// Begins anew with nothing.
  void clear();
  /// How far the serving mapper is. Before the tiles that it published then.
  void adopt(const FrameAccount& account, HoistKnown hoist, TimeNs now);
  /// One of its tiles, in place of what is here.
  void adopt(TileKey key, const std::map<int, BlockClasses>& blocks, const TileHeights& heights);

  [[nodiscard]] OccupancyMap& map() { return *map_; }
  [[nodiscard]] const FrameAccount& account() const { return account_; }
  /// What is known of the hoist since the last frame.
  [[nodiscard]] HoistKnown hoist() const { return hoist_known_; }
  /// Age of the map; see AgeClock.
  [[nodiscard]] TimeNs age() const { return ages_.time(); }
  void restore(const FrameAccount& account, TimeNs age);
  [[nodiscard]] const PointCloud* paper_cloud() const {
    return paper_ ? &paper_->filtered() : nullptr;
  }
  [[nodiscard]] TimeNs last_arrival() const { return last_arrival_; }
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }

  StageTimes stages;
  DropCounts dropped;

 private:
  enum class Placing { kPlaced, kWait, kGap };
  Placing place(CloudSample& cloud, TimeNs now);
  /// How long a cloud waits that cannot be placed. What a player sends again until it is accounted
  /// for waits longer, unless the cloud before it did so in vain.
  [[nodiscard]] TimeNs patience(const CloudSample& cloud, Placing placing) const;
  void account_for(const CloudSample& cloud, bool integrated);
  void cut_out_hoist(CloudSample& cloud);
  void integrate(CloudSample& cloud);

  MapperConfig config_;
  StereoRig rig_;
  double ceiling_m_;
  std::unique_ptr<OccupancyMap> map_;
  ProjectiveIntegrator integrator_;
  std::optional<PaperMapper> paper_;
  bool stale_ = false;
  PositionTrack cart_, trolley_;
  HoistTracker hoist_;
  HoistKnown hoist_known_;
  AgeClock ages_;
  Forgetting forgetting_;
  std::deque<CloudSample> pending_;
  FrameAccount account_;
  std::uint64_t position_stream_ = 0;
  TimeNs last_arrival_ = 0;
  std::int64_t newest_queued_ = -1;
  bool gave_up_ = false;  ///< the last cloud had no position
  std::uint64_t dropped_points_ = 0, cut_out_ = 0;
};

}  // namespace crane
