// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"
#include "recording/recording.hpp"

namespace crane {

/// Something wrong with what a recording says of itself, of a known kind and size.
struct Fault {
  std::string kind;
  double value = 0;
};

/// Reads KIND=VALUE. Error: Configuration, naming the kinds there are.
Result<Fault> parse_fault(const std::string& text);
/// All kinds with their units, for people.
std::string fault_kinds();

/// The rig as a wrong calibration says it is.
StereoRig told_rig(StereoRig true_rig, const std::vector<Fault>& faults);

/// What a rangefinder with these faults says. `middle` is the exposure that single faults hit.
void spoil(std::vector<RecordedDistance>& readings, const std::vector<Fault>& faults, bool cart,
           TimeNs middle);

}  // namespace crane
