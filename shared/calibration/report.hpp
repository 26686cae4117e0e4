// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/stereo_calibration.hpp"
#include "recording/image_file.hpp"

namespace crane {

/// A pair as matching will see it: rectified, side by side, with rows drawn through both.
/// Empty where the images are not of the calibrated size.
Image rectified_pair(const StereoCalibration& calibration, const Image& left, const Image& right);

/// The report as one page without anything from outside, for screen and printer. `pair` may be
/// empty. `title`: whose calibration it is.
std::string report_page(const StereoCalibration& calibration, const std::string& title,
                        const Image& pair);

}  // namespace crane
