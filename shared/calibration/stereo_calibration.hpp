// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/bundle.hpp"
#include "calibration/coverage.hpp"
#include "calibration/uncertainty.hpp"
#include "calibration/view.hpp"

namespace crane {

struct StereoCalibrationOptions {
  LensFit model = LensFit::kRadialTangential;
  double floor_m = 10;               ///< from the camera: what the height's sigma is told for
  std::optional<double> baseline_m;  ///< as the maker says; a check of the board's square
};

/// A view that is not used, and why.
struct RejectedView {
  std::string name, reason;
};

/// What one used view says [px].
struct ViewErrors {
  std::string name;
  double left_px = 0, right_px = 0;  ///< root mean square of its corners, each eye; 0 = not seen
  double epipolar_px = 0;            ///< of the rows of the same corner in the rectified pair
  int corners = 0;
};

enum class CalibrationVerdict { kGood, kUsable, kBad };

struct StereoCalibration {
  RigEstimate rig;
  Board board;
  ImageSize size;
  std::vector<View> views;  ///< those used, without the corners that were dropped
  std::vector<ViewErrors> errors;
  std::vector<RejectedView> rejected;
  std::vector<Residual> residuals;
  int renumbered = 0;  ///< views whose corners were numbered from the other end
  int dropped = 0;     ///< corners far off what all others say
  Coverage coverage;
  double floor_m = 0;
  ImageGrid direction_sigma_px, height_sigma_m;
  /// Two calibrations of half the views each: how far apart they put the floor [m], and how far
  /// apart their own sigmas let expect (1 sigma, median over the image). 0, 0: too few views.
  double halves_apart_m = 0, halves_expected_m = 0;
  CalibrationVerdict verdict = CalibrationVerdict::kBad;
  std::vector<std::string> remarks;  ///< why the verdict is not better, and what to do
};

/// Calibrates two cameras from views of a board. Robust first; then corners beyond four sigma are
/// dropped, and views whose corners do not fit the others are rejected with the reason; then least
/// squares with covariance. Error: BadData, where no calibration comes of these views.
Result<StereoCalibration> calibrate_stereo(std::vector<View> views, const Board& board,
                                           const ImageSize& size,
                                           const StereoCalibrationOptions& options);

}  // namespace crane
