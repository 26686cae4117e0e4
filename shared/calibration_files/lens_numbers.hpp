// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "geometry/stereo_rig.hpp"

namespace crane {

/// Coefficients in OpenCV's order; missing ones are 0. Radial-tangential with k4, k5 or k6 becomes
/// rational. What is beyond the eighth must be 0.
void set_lens_numbers(LensModel model, const std::vector<double>& d, CameraModel& camera);

/// k1 k2 p1 p2 k3 (k4 k5 k6), or k1 k2 k3 k4 of an equidistant lens.
std::vector<double> lens_numbers(const CameraModel& camera);

/// The matrix of a camera, row by row.
std::vector<double> camera_matrix(const CameraModel& camera);
/// And back. False: a row is not that of a camera without skew.
bool set_camera_matrix(const std::vector<double>& k, CameraModel& camera);

/// False: these are no size of an image in pixels.
bool set_image_size(const std::vector<double>& size, CameraModel& camera);

/// Row by row.
std::vector<double> matrix_numbers(const Eigen::Isometry3d& T);
/// From 12 or 16 numbers, row by row.
Eigen::Isometry3d transform_of(const std::vector<double>& numbers);

/// Error: `format` has no place for the lens model.
Result<void> refuse_lens(const StereoRig& rig, const std::string& format, bool k3, bool rational,
                         bool equidistant);

}  // namespace crane
