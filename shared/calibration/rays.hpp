// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/lens.hpp"

namespace crane {

/// Points on the plane z = 1 of a camera's frame that it sees at these pixels (x, y).
std::vector<Eigen::Vector3d> rays(const LensNumbers& lens,
                                  const std::vector<Eigen::Vector2d>& pixels);

}  // namespace crane
