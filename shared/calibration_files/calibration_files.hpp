// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration_files/formats.hpp"
#include "geometry/stereo_rig.hpp"

namespace crane {

/// Formats that a stereo calibration is kept in.
enum class CalibrationFormat {
  kCranemap,  ///< ours: cam0, cam1 as EuRoC, also other lenses; rig.yaml
  kEuroc,
  kKalibr,
  kRos,
  kOpencv,
  kOpencvXml,
  kZed,
  kOrbSlam,
  kMrcal,
};
/// As the command line names them, in that order.
inline constexpr const char* kCalibrationFormats[] = {
    "cranemap", "euroc", "kalibr", "ros", "opencv", "opencv-xml", "zed", "orb-slam", "mrcal"};

struct CalibrationFile {
  StereoRig rig;
  CalibrationFormat format = CalibrationFormat::kCranemap;
  bool mounted = false;  ///< it says where the camera hangs, too: only ours does
};

/// Reads a calibration from a folder, from one file, or from two (left and right, or intrinsics
/// and extrinsics); told apart by their names and content unless `format` says. Checks that two
/// cameras side by side can be as it says. Error: Configuration, with file and line.
Result<CalibrationFile> read_calibration(const std::vector<std::string>& paths,
                                         std::optional<CalibrationFormat> format,
                                         const AskedSize& size);

/// The same from texts in the order above; for tests with texts of anybody.
Result<StereoRig> parse_calibration(const Texts& texts, CalibrationFormat format,
                                    const AskedSize& size);

/// Writes it into a new or empty folder. `mount_told`: rig.T_map_camera_at_zero is known, as ours
/// needs. Returns the files' names. Error: Configuration for what the format cannot hold, and for
/// mrcal's, which is only read; Resource.
Result<std::vector<std::string>> write_calibration(const StereoRig& rig, bool mount_told,
                                                   CalibrationFormat format,
                                                   const std::string& folder);

}  // namespace crane
