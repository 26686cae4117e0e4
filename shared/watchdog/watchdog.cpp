// SPDX-License-Identifier: Apache-2.0
#include "watchdog/watchdog.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr std::size_t kMostSamples = 400;
/// Samples nearer to the one before, as a share of the camera's height, tell nothing new.
constexpr double kNewSample = 0.003;
constexpr double kSpeedChanged_mps = 0.05;
constexpr int kGiveUp = 20;          ///< frames in a row that fit the key nowhere
constexpr double kNewKey = 0.6;      ///< overlap with the key below which there is a new one
constexpr std::size_t kPending = 3;  ///< frames in a row that jumped, and it is no single reading
/// What a change of speed and a way can do to the next frame: a delay, a scale.
/// Nor is less than this share of the height a jump: a quarter of a degree of a mount that bends.
constexpr double kJump = 0.004;
constexpr double kDelay_s = 0.25, kScale = 0.02;
/// A way back instead of a way: a scale of -2, near enough.
constexpr double kReversed = 0.4;
constexpr unsigned kLeastRowPatches = 12;
constexpr int kLeastRowFrames = 3;
constexpr double kRowFrames = 10;  ///< what is said of rows is the mean of about so many frames
/// Disparities err together, by their being drawn to whole pixels [share of one's sigma].
constexpr double kTogether = 0.7;
/// So many standard deviations are no chance.
constexpr double kClear = 5, kClearMotion = 4;
constexpr double kLeastSpan_s = 5;

}  // namespace

Watchdog::Watchdog(const WatchdogLimits& limits, double height_m, double baseline_m)
    : limits_(limits),
      height_m_(height_m),
      baseline_m_(baseline_m),
      floor_(height_m),
      images_(height_m) {}

void Watchdog::begin_anew() {
  images_.clear();
  samples_.clear();
  pending_.clear();
  last_.reset();
}

bool Watchdog::look(const DepthFrame& frame, const Sight& sight) {
  look_at(frame, view_);
  // Disparities that are all wrong by the same make all depths, and so all ways, wrong by it.
  const double disparity_px = frame.f_px * frame.baseline_m / height_m_;
  depth_sigma_share_ = kTogether * frame.sigma_disparity_px / disparity_px;
  const double sigma_m = height_m_ / disparity_px * frame.sigma_disparity_px;
  floor_.add(view_, sigma_m);
  const bool followed = follow(frame, sight);
  judge();
  return followed && state_ != WatchState::kWrong;
}

void Watchdog::see_rows(const RowError& r) {
  if (r.patches < kLeastRowPatches) return;
  ++row_frames_;
  if (rows_.patches == 0) rows_ = r;
  const double share = std::max(1. / row_frames_, 1 / kRowFrames);
  const auto mean = [share](double& to, double from) { to += share * (from - to); };
  mean(rows_.offset_px, r.offset_px), mean(rows_.offset_sigma_px, r.offset_sigma_px);
  mean(rows_.roll_rad, r.roll_rad), mean(rows_.roll_sigma_rad, r.roll_sigma_rad);
  mean(rows_.slope, r.slope), mean(rows_.slope_sigma, r.slope_sigma);
  rows_.patches = r.patches;
  judge();
}

// ------------------------------------------------------------------ Images against positions.

/// False: the frame lies elsewhere than its positions say.
bool Watchdog::follow(const DepthFrame& frame, const Sight& sight) {
  Eigen::Vector2d expected_m = Eigen::Vector2d::Zero();
  if (last_) expected_m = (pending_.empty() ? *last_ : pending_.back()).off_m - key_off_m_;
  const auto seen = images_.measure(frame, sight.exposure, expected_m);
  if (!seen) {
    // Nothing to compare with: from here on anew, and what was known before stays said.
    if (images_.has_key() && images_.overlap() > kNewKey / 2 && images_.lost() < kGiveUp)
      return pending_.empty();
    if (!images_.make_key()) return true;
    samples_.clear();
    pending_.clear();
    key_off_m_.setZero();
    last_ = MotionSample{double(sight.exposure) * 1e-9, sight.place_m, sight.speed_mps,
                         Eigen::Vector2d::Zero(), 0};
    samples_.push_back(*last_);
    return true;
  }
  const MotionSample sample{double(sight.exposure) * 1e-9, sight.place_m, sight.speed_mps,
                            key_off_m_ + seen->off_m, seen->sigma_m};
  if (jumps(sample)) {
    pending_.push_back(sample);
    if (pending_.size() >= kPending) judge_pending();
    return false;
  }
  pending_.clear();
  keep(sample);
  if (images_.overlap() < kNewKey && images_.make_key()) key_off_m_ = sample.off_m;
  return true;
}

bool Watchdog::jumps(const MotionSample& s) {
  if (!last_) return false;
  const double passed_s = s.time_s - last_->time_s;
  const Eigen::Vector2d way_m = s.place_m - last_->place_m;
  const Eigen::Vector2d change_m = s.off_m - last_->off_m;
  Eigen::Vector2d speed_mps = image_speed_mps_;
  if (passed_s > 0) speed_mps = (way_m + change_m) / passed_s;
  // Readings that jump have a speed that images do not; images of stops have one that readings
  // do not.
  const double faster_mps =
      std::min((speed_mps - image_speed_mps_).norm(), (s.speed_mps - last_->speed_mps).norm());
  const double allowed_m = std::max({limits_.jump_m, kJump * height_m_,
                                     std::min(8 * usual_change_m_, 3 * limits_.jump_m)}) +
                           kDelay_s * faster_mps + kScale * way_m.norm() + 4 * s.sigma_m;
  if (change_m.norm() > allowed_m) return true;
  usual_change_m_ += 0.1 * (change_m.norm() - usual_change_m_);
  image_speed_mps_ = speed_mps;
  return false;
}

void Watchdog::keep(const MotionSample& s) {
  last_ = s;
  const auto news = [&](const MotionSample& b) {
    return (s.place_m - b.place_m).norm() > kNewSample * height_m_ ||
           (s.speed_mps - b.speed_mps).norm() > kSpeedChanged_mps;
  };
  if (!samples_.empty() && !news(samples_.back())) return;
  samples_.push_back(s);
  if (samples_.size() > kMostSamples) samples_.erase(samples_.begin());
  if (samples_.size() < 3) return;
  for (const int axis : {0, 1}) fits_[static_cast<std::size_t>(axis)] = fit_axis(samples_, axis);
}

/// Frames went on lying elsewhere: is it a step, or something that grows with the way?
void Watchdog::judge_pending() {
  std::vector<MotionSample> all = samples_;
  all.insert(all.end(), pending_.begin(), pending_.end());
  const Eigen::Vector2d off_m = pending_[kPending / 2].off_m - last_->off_m;
  const int axis = std::abs(off_m.x()) > std::abs(off_m.y()) ? 0 : 1;
  const AxisFit fit = fit_axis(all, axis);
  const auto step = best_step(all, axis);
  if (!step || step->rest_m < 0.7 * fit.rest_m) {
    jumped_ = Misfit{axis == 0 ? Suspect::kCartJump : Suspect::kTrolleyJump,
                     WatchState::kWrong,
                     {step ? step->size_m : -off_m[axis], std::max(0.001, pending_[0].sigma_m)}};
  } else {
    jumped_ = Misfit{Suspect::kMotion, WatchState::kWrong, {off_m.norm(), 0.001}};
    fits_[static_cast<std::size_t>(axis)] = fit;
  }
  // What comes is compared with these.
  for (const MotionSample& s : pending_) keep(s);
  pending_.clear();
}

// ------------------------------------------------------------------ What that says together.

void Watchdog::consider(Suspect suspect, const Figure& figure, const WatchdogLimits::Pair& limits,
                        double least_sigmas) {
  if (!figure.known() || figure.sigmas() < least_sigmas) return;
  const double size = std::abs(figure.value);
  if (size < limits.drifting) return;
  found_.push_back(
      {suspect, size < limits.wrong ? WatchState::kDrifting : WatchState::kWrong, figure});
}

void Watchdog::judge_rows() {
  if (row_frames_ < kLeastRowFrames) return;
  consider(Suspect::kRoll, {rows_.roll_rad, rows_.roll_sigma_rad}, limits_.roll_rad, kClear);
  consider(Suspect::kRowOffset, {rows_.offset_px, rows_.offset_sigma_px}, limits_.row_offset_px,
           kClear);
  consider(Suspect::kRowSlope, {rows_.slope, rows_.slope_sigma}, limits_.row_slope, kClear);
}

/// A floor that lies too low, or a camera that hangs too high, or all depths too large? The way in
/// the images is depth times angle: it is too long only if depths are.
void Watchdog::judge_height() {
  const FloorWatch::Finding& f = floor_.finding();
  depth_share_ = 0;
  const double share = -f.height_m.value / height_m_;
  const Figure height{f.height_m.value, f.height_m.sigma};
  const bool off = f.height_m.known() && f.height_m.sigmas() > kClear &&
                   std::abs(share) > limits_.height_share.drifting;
  if (off) {
    int votes = 0, for_depth = 0;
    for (const AxisFit& fit : fits_) {
      if (fit.scale.sigma > 0.25 * std::abs(share)) continue;
      ++votes;
      if (std::abs(fit.scale.value - share) < std::abs(fit.scale.value)) ++for_depth;
    }
    WatchdogLimits::Pair limits = limits_.height_share;
    limits.drifting *= height_m_, limits.wrong *= height_m_;
    if (votes == 0) {
      consider(Suspect::kDepthOrHeight, height, limits, kClear);
    } else if (for_depth < votes) {
      consider(Suspect::kHeight, height, limits, kClear);
    } else {
      depth_share_ = share;
      const double bend = f.bend_m.value / f.height_m.value;
      const double sigma = f.bend_m.sigma / std::abs(f.height_m.value);
      const Suspect which = sigma > 0.25 ? Suspect::kDepth
                            : bend > 0.5 ? Suspect::kToeIn
                                         : Suspect::kBaseline;
      consider(which, {share, height.sigma / height_m_}, limits_.height_share, kClear);
    }
  }
  // A roll of the right camera makes disparities, and so heights, grow down the image.
  const double by_roll = std::abs(rows_.roll_rad) * height_m_ / baseline_m_;
  const Figure& x = f.slope_x;
  const Figure& y = f.slope_y;
  if (by_roll > limits_.tilt_rad.drifting && std::abs(rows_.roll_rad) > limits_.roll_rad.drifting)
    return;
  const double x_sigmas = x.sigmas();
  const double y_sigmas = y.sigmas();
  consider(Suspect::kTilt, x_sigmas > y_sigmas ? x : y, limits_.tilt_rad, kClear);
}

/// A camera that sways errs slowly: it takes a few of its periods, or a way beside which it is
/// little, until the residuals show it.
bool Watchdog::long_enough_to_judge() const {
  if (samples_.empty()) return false;
  Eigen::Vector2d low_m = samples_.front().place_m;
  Eigen::Vector2d high_m = low_m;
  for (const MotionSample& s : samples_) {
    low_m = low_m.cwiseMin(s.place_m);
    high_m = high_m.cwiseMax(s.place_m);
  }
  return samples_.back().time_s - samples_.front().time_s > kLeastSpan_s ||
         (high_m - low_m).maxCoeff() > height_m_;
}

void Watchdog::judge_motion() {
  const bool long_enough = long_enough_to_judge();
  const auto both = [](const Figure& a, const Figure& b, double sign) {
    const double wa = 1 / (a.sigma * a.sigma);
    const double wb = 1 / (b.sigma * b.sigma);
    return Figure{(wa * a.value + sign * wb * b.value) / (wa + wb), 1 / std::sqrt(wa + wb)};
  };
  const AxisFit& cart = fits_[0];
  const AxisFit& trolley = fits_[1];
  for (const bool is_cart : {true, false}) {
    Figure scale = is_cart ? cart.scale : trolley.scale;
    if (!scale.known()) continue;
    if (scale.sigma < 0.1 && std::abs(scale.value + 2) < kReversed) {
      consider(is_cart ? Suspect::kCartDirection : Suspect::kTrolleyDirection, scale, {1, 1},
               kClearMotion);
      continue;
    }
    if (!long_enough) continue;
    scale.value -= depth_share_;
    scale.sigma = std::hypot(scale.sigma, depth_sigma_share_);
    consider(is_cart ? Suspect::kCartScale : Suspect::kTrolleyScale, scale, limits_.scale_share,
             kClearMotion);
  }
  if (!long_enough) return;
  if (cart.turn.known() || trolley.turn.known())
    consider(Suspect::kTurned, both(cart.turn, trolley.turn, -1), limits_.turn_rad, kClearMotion);
  const Figure& c = cart.delay_s;
  const Figure& t = trolley.delay_s;
  if (c.sigmas() > kClearMotion && t.sigmas() > kClearMotion &&
      std::abs(c.value - t.value) < std::max(0.01, 3 * std::hypot(c.sigma, t.sigma))) {
    consider(Suspect::kCameraDelay, both(c, t, 1), limits_.delay_s, kClearMotion);
  } else {
    consider(Suspect::kCartDelay, c, limits_.delay_s, kClearMotion);
    consider(Suspect::kTrolleyDelay, t, limits_.delay_s, kClearMotion);
  }
}

void Watchdog::judge() {
  found_.clear();
  judge_rows();
  judge_height();
  judge_motion();
  settle();
}

/// The first of those that weigh most; what is wrong stays so.
void Watchdog::settle() {
  if (jumped_ && jumped_->suspect != Suspect::kMotion) found_.insert(found_.begin(), *jumped_);
  if (jumped_ && jumped_->suspect == Suspect::kMotion) found_.push_back(*jumped_);
  Misfit worst;
  for (const Misfit& m : found_)
    if (m.state > worst.state) worst = m;
  if (state_ == WatchState::kWrong && worst.state != WatchState::kWrong) return;
  state_ = worst.state;
  worst_ = worst;
}

}  // namespace crane
