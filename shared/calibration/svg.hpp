// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration/stereo_calibration.hpp"

namespace crane {

/// Pictures of a calibration for a page: <svg> elements without anything from outside.
/// Corners that were used, and parts of the image without enough of them.
std::string svg_coverage(const StereoCalibration& calibration, bool right);
/// What the fit leaves of each corner, drawn longer so that it can be seen.
std::string svg_residuals(const StereoCalibration& calibration, bool right);
/// A figure over the image, `scale` times its values, with numbers in its cells.
std::string svg_grid(const ImageGrid& grid, const ImageSize& size, double scale);
/// Root mean square of each view, as bars.
std::string svg_views(const StereoCalibration& calibration);

}  // namespace crane
