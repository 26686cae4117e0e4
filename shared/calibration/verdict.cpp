// SPDX-License-Identifier: Apache-2.0
#include "calibration/verdict.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"

namespace crane {
namespace {

constexpr std::size_t kViewsGood = 15, kViewsUsable = 8;
constexpr double kHeightGood = 0.005, kHeightUsable = 0.02;  ///< of the floor's distance, 1 sigma
constexpr double kRowsGood_px = 0.25, kRowsUsable_px = 0.6;
constexpr double kBaselineOff = 0.02;  ///< of what the maker says
constexpr double kHalvesOff = 4;       ///< sigmas between calibrations of half the views
constexpr double kWarpSeen = 0.004;    ///< of the board's size

}  // namespace

double epipolar_rms(const StereoCalibration& calibration) {
  double sum = 0;
  int views = 0;
  for (const ViewErrors& v : calibration.errors)
    if (v.left_px > 0 && v.right_px > 0) {
      sum += v.epipolar_px * v.epipolar_px;
      ++views;
    }
  return views > 0 ? std::sqrt(sum / views) : 0;
}

void give_verdict(StereoCalibration& c, std::optional<double> baseline_m) {
  c.verdict = CalibrationVerdict::kGood;
  const auto at_most = [&c](CalibrationVerdict verdict, std::string remark) {
    c.verdict = std::max(c.verdict, verdict);
    c.remarks.push_back(std::move(remark));
  };
  using enum CalibrationVerdict;
  const Eigen::Vector3d t = c.rig.T_right_left.translation();
  if (t.x() > 0)
    at_most(kBad, "the right camera stands left of the left one: left and right are swapped");
  if (baseline_m) {
    const double ratio = c.rig.baseline_m() / *baseline_m;
    if (std::abs(ratio - 1) > kBaselineOff)
      at_most(kBad, formatted("the baseline comes out as %.1f mm, the maker says %.1f: measure the "
                              "board's squares again (%.2f mm each would agree)",
                              1000 * c.rig.baseline_m(), 1000 * *baseline_m,
                              1000 * c.board.square_m / ratio));
  }
  const double height = c.height_sigma_m.most() / c.floor_m;
  if (height > kHeightGood)
    at_most(height > kHeightUsable ? kBad : kUsable,
            formatted("heights of a floor at %.1f m are sure to %.1f cm only (1 sigma, in 95 %% of "
                      "the image): take more views, nearer ones, and in the corners",
                      c.floor_m, 100 * c.height_sigma_m.most()));
  const double rows = epipolar_rms(c);
  if (rows > kRowsGood_px)
    at_most(rows > kRowsUsable_px ? kBad : kUsable,
            formatted("rows of the rectified images differ by %.2f px: sharper images, a stiffer "
                      "board, or a lens model with more numbers (--lens)",
                      rows));
  if (c.views.size() < kViewsGood)
    at_most(c.views.size() < kViewsUsable ? kBad : kUsable,
            formatted("%zu views were of use; 20 to 40 are good", c.views.size()));
  if (c.halves_expected_m > 0 && c.halves_apart_m > kHalvesOff * c.halves_expected_m)
    at_most(kUsable, formatted("two halves of the views put the floor %.1f cm apart where %.1f are "
                               "expected: something moved between the views, or the lens needs a "
                               "model with more numbers (--lens)",
                               100 * c.halves_apart_m, 100 * c.halves_expected_m));
  const auto apart = std::count_if(c.rejected.begin(), c.rejected.end(), [](const auto& view) {
    return view.reason.find("not taken at the same time") != std::string::npos;
  });
  if (apart > 1)
    at_most(kUsable, formatted("%td pairs were not taken at the same time: trigger both cameras by "
                               "one signal, or hold the board on a stand",
                               apart));
  if (c.rejected.size() > c.views.size()) at_most(kBad, "more views were rejected than used");
  if (c.rig.warp_m.cwiseAbs().maxCoeff() > kWarpSeen * c.board.size_m())
    at_most(kUsable,
            formatted("the board is bent by %.1f mm; that is reckoned with, but a stiff one "
                      "is better",
                      1000 * c.rig.warp_m.cwiseAbs().maxCoeff()));
  for (std::string& advice : wanted(c.coverage)) c.remarks.push_back(std::move(advice));
}

}  // namespace crane
