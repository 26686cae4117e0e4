// SPDX-License-Identifier: Apache-2.0
#include "mount/mount_values.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr double kDeg = 180 / M_PI;
/// A sigma above this tells nothing of use.
constexpr double kTilt_deg = 0.1, kHeightShare = 0.005, kScale = 0.004, kLatency_ms = 15;
constexpr double kSlope_deg = 0.2, kSkew_deg = 0.1;
/// Disparities of one drive err together, by how images are drawn to whole pixels: by this share of
/// what single ones err (a hundredth of a pixel or less in rendered drives). No residual shows it.
constexpr double kTogether = 0.1;
constexpr double kStands_mps = 0.02;
constexpr std::size_t kLeastHook = 8;
constexpr double kHookReach_m = 0.6;  ///< the hook is no taller

/// tilt x, tilt y, yaw [deg] of the camera.
Eigen::Vector3d angles(const Eigen::Matrix3d& R_map_camera) {
  const Eigen::Vector3d view = R_map_camera.col(2);
  const Eigen::Vector3d right = R_map_camera.col(0);
  return kDeg * Eigen::Vector3d(std::atan2(view.x(), -view.z()), std::atan2(view.y(), -view.z()),
                                std::atan2(right.y(), right.x()));
}

class Values {
 public:
  Values(const Drive& drive, const MountOptions& options, const AxisReadings& readings,
         const MountFit& fit)
      : drive_(drive), options_(options), readings_(readings), fit_(fit) {
    for (std::size_t i = 0; i < kMountItems; ++i) out_.values[i].item = MountItem(i);
  }

  MountCalibration make() {
    out_.rig = drive_.rig;
    out_.mapper = options_.told;
    camera();
    axes();
    offsets();
    skew();
    floor();
    hook();
    facts();
    return std::move(out_);
  }

 private:
  MountValue& value(MountItem item) { return out_.values[static_cast<std::size_t>(item)]; }
  [[nodiscard]] double variance(int number) const { return fit_.covariance(number, number); }
  void set(MountItem item, double v, double sigma, double most, const std::string& todo) {
    MountValue& to = value(item);
    to.determined = std::isfinite(sigma) && sigma <= most;
    if (to.determined)
      to.value = v, to.sigma = sigma;
    else
      to.why_not = todo;
  }
  void leave(MountItem item, const std::string& why) { value(item).why_not = why; }
  [[nodiscard]] bool both() const { return fit_.driven[0] && fit_.driven[1]; }

  void camera() {
    // Where a second rangefinder tells how skew the bridge is, the mount is that of a square one.
    const bool square = !fit_.skew_off.empty();
    const Eigen::Matrix3d R_rectified =
        Eigen::AngleAxisd(square ? std::atan(fit_.skew) : 0, Eigen::Vector3d::UnitZ()) *
        fit_.R_map_rectified;
    const Eigen::Matrix3d R = R_rectified * drive_.camera.R_camera_rectified.transpose();
    const Eigen::Vector3d now = angles(R);
    Eigen::Matrix3d J;  // of the angles by a turn in the rectified camera's frame
    constexpr double kStep = 1e-5;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Matrix3d turned = R_rectified *
                                     Eigen::AngleAxisd(-kStep, Eigen::Vector3d::Unit(k)) *
                                     drive_.camera.R_camera_rectified.transpose();
      J.col(k) =
          (angles(turned) - now).unaryExpr([](double d) { return std::remainder(d, 360); }) / kStep;
    }
    const Eigen::Matrix3d C = J * fit_.covariance.topLeftCorner<3, 3>() * J.transpose();
    const Eigen::Vector3d with_skew = J * fit_.covariance.block<3, 1>(0, MountFit::kSkew);
    const double yaw_variance =
        C(2, 2) + (square ? kDeg * (2 * with_skew.z() + kDeg * variance(MountFit::kSkew)) : 0);
    const std::string other = "drive bridge and trolley: one axis alone does not tell";
    const std::string longer = "drive farther, or more slowly";
    const std::string todo = both() ? longer : other;
    set(MountItem::kTiltX, now.x(), std::sqrt(C(0, 0)), both() ? kTilt_deg : -1, todo);
    set(MountItem::kTiltY, now.y(), std::sqrt(C(1, 1)), both() ? kTilt_deg : -1, todo);
    set(MountItem::kYaw, now.z(), std::sqrt(std::max(0.0, yaw_variance)), kTilt_deg, longer);
    set(MountItem::kHeight, fit_.height_m,
        std::hypot(std::sqrt(variance(MountFit::kHeight)), depth_share() * fit_.height_m),
        both() ? kHeightShare * fit_.height_m : -1, todo);
    if (!both()) return;
    out_.rig.T_map_camera_at_zero.linear() = R;
    out_.rig.T_map_camera_at_zero.translation().z() = fit_.height_m;
  }

  void axes() {
    for (const std::size_t k : {0U, 1U}) {
      const bool cart = k == 0;
      const MountItem direction = cart ? MountItem::kCartDirection : MountItem::kTrolleyDirection;
      const MountItem scale = cart ? MountItem::kCartScale : MountItem::kTrolleyScale;
      const MountItem latency = cart ? MountItem::kCartLatency : MountItem::kTrolleyLatency;
      if (!fit_.driven[k]) {
        const std::string why = formatted(
            "the %s was not driven: drive it at least %.1f m there and back",
            cart ? "bridge" : "trolley", std::max(1.0, 2 * DriveNeeds::way_m(fit_.height_m)));
        for (const MountItem item : {direction, scale, latency}) leave(item, why);
        continue;
      }
      const int sign = fit_.gain[k] > 0 ? 1 : -1;
      set(direction, sign, 0, 0, "");
      (cart ? out_.mapper.cart_direction : out_.mapper.trolley_direction) = sign;
      set(scale, std::abs(fit_.gain[k]),
          std::hypot(std::sqrt(variance(MountFit::kGain + int(k))), depth_share()), kScale,
          "drive farther");
      if (value(scale).determined) out_.scale[k] = value(scale).value;
      const double sigma_s =
          std::max(std::sqrt(variance(MountFit::kLatency + int(k))), delay_sigma_s(k));
      set(latency, 1e3 * fit_.latency_s[k], 1e3 * sigma_s, kLatency_ms,
          "the speed did not change enough: start and stop several times, both ways, faster");
      if (value(latency).determined)
        (cart ? out_.mapper.cart_latency_ms : out_.mapper.trolley_latency_ms) =
            int(std::lround(value(latency).value));
    }
  }

  /// By which all depths, and so all lengths, may be wrong alike.
  [[nodiscard]] double depth_share() const {
    const RectifiedCamera& c = drive_.camera;
    return kTogether * std::sqrt(2.0) * fit_.pixel_sigma * fit_.height_m / (c.f_px * c.baseline_m);
  }

  /// A delay shows only where the speed changes: by the images, since a reading's noise looks like
  /// changes of its speed as well.
  [[nodiscard]] double delay_sigma_s(std::size_t k) const {
    constexpr std::size_t kApart = 2;
    double sum = 0, squares = 0, n = 0;
    for (std::size_t i = kApart; i + kApart < fit_.place_m.size(); ++i) {
      const double passed_s = double(drive_.frames[fit_.first + i + kApart].time -
                                     drive_.frames[fit_.first + i - kApart].time) *
                              1e-9;
      const double mps = (fit_.place_m[i + kApart] - fit_.place_m[i - kApart])[int(k)] / passed_s;
      sum += mps, squares += mps * mps, ++n;
    }
    const double variance_of_speed = squares / n - sum / n * sum / n;
    return fit_.reading_sigma_m[k] / std::sqrt(std::max(1e-12, variance_of_speed * n));
  }

  /// Direction times scale.
  [[nodiscard]] double gain(std::size_t k) const {
    return (k == 0 ? out_.mapper.cart_direction : out_.mapper.trolley_direction) * out_.scale[k];
  }

  void offsets() {
    for (const std::size_t k : {0U, 1U}) {
      const MountItem item = k == 0 ? MountItem::kCartOffset : MountItem::kTrolleyOffset;
      const double t = 0.2 + fit_.latency_s[k];
      if (!options_.start_m) {
        leave(item, "nobody told where it stood: --start X,Y, by tape or the plant's drawing");
      } else if (std::abs(readings_[k].mps(t)) > kStands_mps) {
        leave(item, "it moved when the recording began: begin while it stands");
      } else {
        double start = (*options_.start_m)[int(k)];
        if (k == 0 && !fit_.skew_off.empty())  // of the first rail, from where the trolley stood
          start -= (fit_.skew + fit_.skew_off.front()) *
                   (options_.start_m->y() - options_.told.rail_y_m);
        const double offset = start - gain(k) * readings_[k].at(t);
        const double by_scale = std::sqrt(variance(MountFit::kGain + int(k))) * readings_[k].at(t);
        set(item, offset, std::hypot(fit_.reading_sigma_m[k], by_scale), 1,
            "the readings are too rough");
        (k == 0 ? out_.mapper.cart_offset_m : out_.mapper.trolley_offset_m) = offset;
      }
    }
  }

  void skew() {
    leave(MountItem::kCartSecondOffset, "the bridge has one rangefinder (mapper.rail_span_m)");
    if (!both()) {
      leave(MountItem::kSkew, "drive bridge and trolley");
      return;
    }
    const double sigma = std::sqrt(variance(MountFit::kSkew));
    set(MountItem::kSkew, -kDeg * std::atan(fit_.skew), kDeg * sigma, kSkew_deg,
        "drive the trolley farther");
    if (fit_.skew_off.empty()) return;
    const Readings second(drive_.cart_second, drive_.frames.front().time, options_.told);
    MapperConfig& m = out_.mapper;
    // The mean of what the second must say so that the skew comes out.
    double sum = 0, xy = 0;
    const double t0 = 0;
    for (std::size_t i = fit_.first; i < fit_.last; ++i) {
      const double t = t0 + double(drive_.frames[i].time - drive_.frames.front().time) * 1e-9;
      const double first = readings_[0].at(t + fit_.latency_s[0]);
      const double other = second.at(t + fit_.latency_s[0]);
      xy += (first - fit_.mean_m[0]) * (other - second.at(fit_.latency_s[0]));
      sum += m.cart_offset_m + gain(0) * first +
             m.rail_span_m * (fit_.skew + fit_.skew_off[i - fit_.first]);
    }
    m.cart_second_direction = xy > 0 ? m.cart_direction : -m.cart_direction;
    for (std::size_t i = fit_.first; i < fit_.last; ++i) {
      const double t = double(drive_.frames[i].time - drive_.frames.front().time) * 1e-9;
      sum -= m.cart_second_direction * out_.scale[0] * second.at(t + fit_.latency_s[0]);
    }
    m.cart_second_latency_ms = m.cart_latency_ms;
    const double offset = sum / double(fit_.last - fit_.first);
    set(MountItem::kCartSecondOffset, offset,
        std::hypot(std::abs(m.rail_span_m) * sigma, fit_.reading_sigma_m[0]),
        std::abs(m.rail_span_m) * kSkew_deg / kDeg, "drive the trolley farther");
    if (out_.of(MountItem::kCartSecondOffset).determined) m.cart_second_offset_m = offset;
  }

  void floor() {
    for (const int i : {0, 1}) {
      const MountItem item = i == 0 ? MountItem::kFloorSlopeX : MountItem::kFloorSlopeY;
      set(item, kDeg * std::atan(fit_.slope[i]), kDeg * std::sqrt(variance(MountFit::kSlope + i)),
          both() ? kSlope_deg : -1,
          both() ? "drive farther" : "drive bridge and trolley: one axis alone does not tell");
    }
  }

  /// What comes along with the camera at the hook's height.
  void hook() {
    if (!options_.hook_height_m) {
      for (const MountItem item : {MountItem::kHookX, MountItem::kHookY})
        leave(item, "the hook's height was not told: --hook-height");
      return;
    }
    std::vector<Eigen::Vector2d> places;
    const RectifiedCamera& c = drive_.camera;
    const Eigen::Vector3d eye = out_.rig.T_map_camera_at_zero.translation();
    for (const DriveFrame& frame : drive_.frames)
      for (const Sighting& s : frame.sightings) {
        if (fit_.kinds[s.track] != TrackKind::kWithCamera) continue;
        const double z = c.f_px * c.baseline_m / (s.u_px - s.right_u_px);
        const Eigen::Vector3d p =
            eye + fit_.R_map_rectified * Eigen::Vector3d((s.u_px - c.cx_px) / c.f_px * z,
                                                         (s.v_px - c.cy_px) / c.f_px * z, z);
        const double above = p.z() - *options_.hook_height_m;
        if (above > -0.1 && above < kHookReach_m) places.emplace_back(p.head<2>());
      }
    const std::string todo =
        "nothing hangs at that height in the view: hang the hook where the camera sees it";
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const auto& p : places) mean += p / double(places.size());
    Eigen::Vector2d squares = Eigen::Vector2d::Zero();
    for (const auto& p : places) squares += (p - mean).cwiseAbs2() / double(places.size());
    // What is seen of a hook is one side of it: as far as its points are spread it may be off.
    const bool enough = places.size() >= kLeastHook;
    set(MountItem::kHookX, mean.x(), std::sqrt(squares.x()), enough ? 0.5 : -1, todo);
    set(MountItem::kHookY, mean.y(), std::sqrt(squares.y()), enough ? 0.5 : -1, todo);
  }

  void facts() {
    DriveFacts& d = out_.drive;
    d.seconds = double(drive_.frames.back().time - drive_.frames.front().time) * 1e-9;
    d.frames = fit_.last - fit_.first;
    const auto of_kind = [&](TrackKind kind) {
      return std::size_t(std::count(fit_.kinds.begin(), fit_.kinds.end(), kind));
    };
    d.tracks = drive_.tracks - of_kind(TrackKind::kShort);
    d.floor_tracks = of_kind(TrackKind::kFloor);
    d.moving_with_camera = of_kind(TrackKind::kWithCamera);
    d.moving_by_itself = of_kind(TrackKind::kMoves);
    d.pixel_sigma = fit_.pixel_sigma;
    d.floor_sigma_m = fit_.floor_sigma_m;
    Eigen::Vector2d origin;
    for (const std::size_t k : {0U, 1U}) {
      d.reading_sigma_m[int(k)] = fit_.reading_sigma_m[k];
      d.dropped_readings[k] = readings_[k].dropped();
      origin[int(k)] = (k == 0 ? out_.mapper.cart_offset_m : out_.mapper.trolley_offset_m) +
                       gain(k) * fit_.mean_m[k];
    }
    Eigen::Vector2d low = fit_.place_m.front();
    Eigen::Vector2d high = low;
    for (std::size_t i = 0; i < fit_.place_m.size(); ++i) {
      const double t =
          double(drive_.frames[fit_.first + i].time - drive_.frames.front().time) * 1e-9;
      const Eigen::Vector2d p = fit_.place_m[i];
      low = low.cwiseMin(p), high = high.cwiseMax(p);
      d.time_s.push_back(t);
      d.path_m.emplace_back(origin + p);
      Eigen::Vector2d off;
      for (const std::size_t k : {0U, 1U}) {
        const double at = t + fit_.latency_s[k];
        off[int(k)] = fit_.gain[k] * (readings_[k].at(at) - fit_.mean_m[k]) - p[int(k)];
        d.speed_mps[int(k)] = std::max(d.speed_mps[int(k)], std::abs(readings_[k].mps(at)));
      }
      d.reading_off_m.push_back(off);
    }
    d.way_m = high - low;
    const Eigen::Vector3d eye = out_.rig.T_map_camera_at_zero.translation();
    for (std::size_t t = 0; t < fit_.points_m.size(); ++t) {
      const bool floor = fit_.kinds[t] == TrackKind::kFloor;
      if (!floor && fit_.kinds[t] != TrackKind::kFixed) continue;
      const Eigen::Vector3d& p = fit_.points_m[t];
      d.points_m.emplace_back(p.x() + origin.x() + eye.x(), p.y() + origin.y() + eye.y(),
                              p.z() + fit_.height_m);
      d.is_floor.push_back(floor);
    }
  }

  const Drive& drive_;
  const MountOptions& options_;
  const AxisReadings& readings_;
  const MountFit& fit_;
  MountCalibration out_;
};

}  // namespace

MountCalibration mount_values(const Drive& drive, const MountOptions& options,
                              const AxisReadings& readings, const MountFit& fit) {
  return Values(drive, options, readings, fit).make();
}

}  // namespace crane
