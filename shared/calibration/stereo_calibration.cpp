// SPDX-License-Identifier: Apache-2.0
#include "calibration/stereo_calibration.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"
#include "calibration/epipolar.hpp"
#include "calibration/verdict.hpp"

namespace crane {
namespace {

constexpr int kRounds = 4;
constexpr double kLeastSigma_px = 0.02;  ///< no corner of a real image is found better
constexpr double kDropped = 4.5;         ///< sigmas; one of 25,000 true corners is further off
constexpr double kViewOff = 6;           ///< sigmas of a view's root mean square ...
constexpr double kViewOff_px = 0.5;      ///< ... and at least so much
constexpr std::size_t kHalfViews = 6;    ///< each half, for the check by halves

/// Of one coordinate, by the median: a few wild corners do not move it.
double robust_sigma(const std::vector<Residual>& all) {
  std::vector<double> sizes;
  for (const auto& r : all)
    for (int i = 0; i < 2; ++i) sizes.push_back(std::abs(r.off[i]));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(kLeastSigma_px, 1.4826 * *middle);
}

/// Root mean square of the coordinates of each view; both eyes together.
std::vector<double> view_rms(const std::vector<Residual>& all, std::size_t views) {
  std::vector<double> sum(views), count(views);
  for (const auto& r : all) {
    sum[r.view] += r.off.squaredNorm();
    count[r.view] += 2;
  }
  for (std::size_t v = 0; v < views; ++v) sum[v] = count[v] > 0 ? std::sqrt(sum[v] / count[v]) : 0;
  return sum;
}

std::string why_rejected(const View& view, const Board& board, const RigEstimate& rig, double rms,
                         double sigma) {
  if (!view.left.empty() && !view.right.empty()) {
    const Apart apart = seen_apart(view, board, rig);
    const double fits = std::max(0.5, 4 * sigma);
    if (apart.left_px < fits && apart.right_px < fits) {
      return formatted(
          "left and right show the board %.1f mm apart: not taken at the same time, or "
          "not of one pair",
          1000 * apart.distance_m);
    }
    if (apart.left_px < fits || apart.right_px < fits) {
      return formatted(
          "the corners in the %s image are wrong (off by %.1f px): blurred, shadowed, or "
          "another thing taken for the board",
          apart.left_px < fits ? "right" : "left", std::max(apart.left_px, apart.right_px));
    }
  }
  return formatted(
      "its corners are off by %.1f px where others are by %.2f: blurred, bent, or another "
      "thing taken for the board",
      rms, sigma);
}

/// Takes out what does not fit. True: something was.
bool take_out(StereoCalibration& c) {
  const auto all = residuals(c.views, c.board, c.rig);
  const double sigma = robust_sigma(all);
  const auto rms = view_rms(all, c.views.size());
  std::vector<std::vector<bool>> keep[2];
  for (auto& eye : keep)
    for (const View& v : c.views)
      eye.emplace_back((&eye == &keep[1] ? v.right : v.left).ids.size(), true);
  bool any = false;
  for (const auto& r : all)
    if (r.off.norm() > kDropped * sigma && rms[r.view] <= std::max(kViewOff * sigma, kViewOff_px)) {
      keep[r.right ? 1 : 0][r.view][r.corner] = false;
      ++c.dropped;
      any = true;
    }
  std::vector<View> views;
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t v = 0; v < c.views.size(); ++v) {
    View& view = c.views[v];
    if (rms[v] > std::max(kViewOff * sigma, kViewOff_px)) {
      c.rejected.push_back({view.name, why_rejected(view, c.board, c.rig, rms[v], sigma)});
      any = true;
      continue;
    }
    for (const bool right : {false, true}) {
      Corners& eye = right ? view.right : view.left;
      Corners left_over;
      for (std::size_t i = 0; i < eye.ids.size(); ++i) {
        if (!keep[right ? 1 : 0][v][i]) continue;
        left_over.ids.push_back(eye.ids[i]);
        left_over.pixels.push_back(eye.pixels[i]);
      }
      eye = std::move(left_over);
    }
    views.push_back(std::move(view));
    poses.push_back(c.rig.T_left_board[v]);
  }
  c.views = std::move(views);
  c.rig.T_left_board = std::move(poses);
  return any;
}

void judge_views(StereoCalibration& c) {
  const auto rows = row_differences(c.views, c.rig);
  for (std::size_t v = 0; v < c.views.size(); ++v) {
    ViewErrors e{c.views[v].name, 0, 0, 0, 0};
    double sum[2] = {0, 0};
    int count[2] = {0, 0};
    for (const auto& r : c.residuals)
      if (r.view == v) {
        sum[r.right ? 1 : 0] += r.off.squaredNorm();
        count[r.right ? 1 : 0] += 2;
      }
    if (count[0] > 0) e.left_px = std::sqrt(sum[0] / count[0]);
    if (count[1] > 0) e.right_px = std::sqrt(sum[1] / count[1]);
    e.corners = (count[0] + count[1]) / 2;
    double squares = 0;
    for (const double row : rows[v]) squares += row * row;
    if (!rows[v].empty()) e.epipolar_px = std::sqrt(squares / static_cast<double>(rows[v].size()));
    c.errors.push_back(e);
  }
}

/// Calibrates by every other view, and by the rest.
void check_by_halves(StereoCalibration& c, LensFit model) {
  std::vector<View> views[2];
  RigEstimate from[2] = {c.rig, c.rig};
  for (auto& rig : from) rig.T_left_board.clear();
  for (std::size_t v = 0; v < c.views.size(); ++v) {
    views[v % 2].push_back(c.views[v]);
    from[v % 2].T_left_board.push_back(c.rig.T_left_board[v]);
  }
  if (std::min(views[0].size(), views[1].size()) < kHalfViews) return;
  const auto a = refine(views[0], c.board, from[0], model, false);
  const auto b = refine(views[1], c.board, from[1], model, false);
  if (!a || !b) return;
  c.halves_apart_m = height_difference(a.value(), b.value(), c.size, c.floor_m).median();
  const double sigma_a = height_sigma(a.value(), c.size, c.floor_m).median();
  const double sigma_b = height_sigma(b.value(), c.size, c.floor_m).median();
  c.halves_expected_m = std::hypot(sigma_a, sigma_b);
}

}  // namespace

Result<StereoCalibration> calibrate_stereo(std::vector<View> views, const Board& board,
                                           const ImageSize& size,
                                           const StereoCalibrationOptions& options) {
  StereoCalibration c;
  c.board = board;
  c.size = size;
  c.floor_m = options.floor_m;
  for (View& view : views) c.renumbered += same_order(board, view) ? 1 : 0;
  c.views = std::move(views);

  auto rig = first_estimate(c.views, board, size);
  if (!rig) return rig.error();
  rig = refine(c.views, board, rig.value(), options.model, true);
  for (int round = 0; round < kRounds; ++round) {
    if (!rig) return rig.error();
    c.rig = rig.value();
    if (!take_out(c)) break;
    if (c.views.empty())
      return Error{ErrorCode::kBadData, "calibration", "no view fits the others",
                   "check the board, and that left and right are of one camera pair"};
    rig = refine(c.views, board, c.rig, options.model, true);
  }
  rig = refine(c.views, board, c.rig, options.model, false);
  if (!rig) return rig.error();
  c.rig = rig.value();
  c.residuals = residuals(c.views, board, c.rig);
  judge_views(c);
  c.coverage = coverage_of(c.views, size, c.rig.T_left_board);
  c.direction_sigma_px = direction_sigma(c.rig, size);
  c.height_sigma_m = height_sigma(c.rig, size, c.floor_m);
  check_by_halves(c, options.model);
  give_verdict(c, options.baseline_m);
  return c;
}

}  // namespace crane
