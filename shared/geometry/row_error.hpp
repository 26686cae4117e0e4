// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// By how many rows the rectified right image lies lower than the left one, as a function over the
/// image: offset_px + roll_rad * (x - middle) + slope * (y - middle) [px]. A median over the image
/// would miss a roll, whose halves cancel.
struct RowError {
  unsigned patches = 0;  ///< that it was measured at; 0 = it could not be
  double offset_px = 0, offset_sigma_px = 0;
  double roll_rad = 0, roll_sigma_rad = 0;  ///< of one camera against the other, about the view axis
  double slope = 0, slope_sigma = 0;        ///< one image is taller than the other by this share
};

}  // namespace crane
