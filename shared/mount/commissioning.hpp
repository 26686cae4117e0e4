// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mount/mount_calibration.hpp"

namespace crane {

/// commissioning.yaml: what was measured on that day, and how surely. Only what was determined.
struct Commissioning {
  struct Value {
    MountItem item = MountItem::kHeight;
    double value = 0, sigma = 0;
  };
  std::string date;  ///< "2026-11-30"; of the recording or the day it was written
  std::vector<Value> values;
};

/// What is to be kept of a calibration.
Commissioning commissioning_of(const MountCalibration& calibration, const std::string& date);
/// As YAML; read_commissioning() accepts it.
std::string to_yaml(const Commissioning& commissioning);
/// Error: Configuration with every problem of the file and its line.
Result<Commissioning> read_commissioning(const std::string& path);
Result<Commissioning> parse_commissioning(const std::string& text, const std::string& name);

enum class CheckState {
  kSame,         ///< within the uncertainty of both
  kChanged,      ///< by more than that and more than matters
  kNotMeasured,  ///< the drive did not tell, or nobody measured it then
};

/// One item then and now.
struct CheckedItem {
  MountItem item = MountItem::kHeight;
  CheckState state = CheckState::kNotMeasured;
  double then = 0, now = 0;
  double sigma = 0;  ///< of the difference
  std::string text;  ///< a sentence: by how much, and what to do
};

/// `now`: of a recording in service, placed by the calibration in use.
std::vector<CheckedItem> compare(const Commissioning& then, const MountCalibration& now);

}  // namespace crane
