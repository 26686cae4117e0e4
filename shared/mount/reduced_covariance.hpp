// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ceres {
class Problem;
}

namespace crane {

/// The covariance of a few parameter blocks, all others marginalised, for residuals of unit
/// variance. `eliminated`: blocks of three that share no residual with each other (points): they go
/// first, so that what is inverted stays small. Constant blocks have zero rows. Directions that no
/// residual tells have variances that are very large, not infinite.
Eigen::MatrixXd reduced_covariance(ceres::Problem& problem, const std::vector<double*>& wanted,
                                   const std::vector<double*>& eliminated);

}  // namespace crane
