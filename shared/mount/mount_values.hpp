// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mount/mount_calibration.hpp"
#include "mount/mount_fit.hpp"

namespace crane {

/// The fit in the items' terms, with sigmas; rig and keys to be written; facts of the drive.
MountCalibration mount_values(const Drive& drive, const MountOptions& options,
                              const AxisReadings& readings, const MountFit& fit);

/// Sets verdict, remarks and targets.
void judge_mount(const Drive& drive, const MountOptions& options, const AxisReadings& readings,
                 const MountFit& fit, const std::vector<double>& levels_m, MountCalibration& out);

}  // namespace crane
