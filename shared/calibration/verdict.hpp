// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calibration/stereo_calibration.hpp"

namespace crane {

/// Sets verdict and remarks from all else. `baseline_m`: as the maker says.
void give_verdict(StereoCalibration& calibration, std::optional<double> baseline_m);

/// Root mean square over all views [px].
double epipolar_rms(const StereoCalibration& calibration);

}  // namespace crane
