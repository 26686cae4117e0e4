// SPDX-License-Identifier: Apache-2.0
#include "sim/faults.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace crane {
namespace {

struct Kind {
  const char* name;
  const char* unit;
  double most;  ///< of either sign
};

constexpr Kind kCalibration[] = {
    {"toe_in", "deg, right camera about its y axis", 10},
    {"roll", "deg, right camera about its view axis", 10},
    {"pitch", "deg, right camera about its x axis", 10},
    {"tilt", "deg, mount about map y", 45},
    {"yaw", "deg, mount about map z", 180},
    {"height", "m, mount", 100},
    {"baseline", "m longer", 5},
    {"focal", "share longer, both cameras", 0.9},
    {"principal", "px to the right, right camera", 5000},
    {"distortion", "added to k1 of both cameras", 1},
};
constexpr Kind kRange[] = {
    {"zero", "readings of 0 from the middle exposure on", 1e6},
    {"outlier", "m, the reading nearest to the middle exposure", 1e4},
    {"jump", "m, from the middle exposure on", 1e4},
    {"offset", "m, all readings", 1e4},
    {"scale", "share longer, all readings", 0.9},
    {"direction", "m: length of the track; measured from its other end", 1e4},
    {"drop_out", "s without readings around the middle exposure", 1e4},
    {"delay", "ms later than they were true", 1e5},
};
const std::string kTrolley = "trolley_";

const Kind* find(const std::string& name) {
  for (const Kind& kind : kCalibration)
    if (name == kind.name) return &kind;
  const std::string range = name.starts_with(kTrolley) ? name.substr(kTrolley.size()) : name;
  for (const Kind& kind : kRange)
    if (range == kind.name) return &kind;
  return nullptr;
}

Eigen::Matrix3d about(const Eigen::Vector3d& axis, double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis).toRotationMatrix();
}

}  // namespace

std::string fault_kinds() {
  std::string out = "calibration:";
  for (const Kind& kind : kCalibration) out += std::string("\n  ") + kind.name + "  " + kind.unit;
  out += "\nrangefinder of the cart, or of the trolley with trolley_ before it:";
  for (const Kind& kind : kRange) out += std::string("\n  ") + kind.name + "  " + kind.unit;
  return out;
}

Result<Fault> parse_fault(const std::string& text) {
  const auto bad = [&](const std::string& what) {
    return Error{ErrorCode::kConfiguration, "fault '" + text + "'", what,
                 "give KIND=VALUE, kinds are\n" + fault_kinds()};
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return bad("is not KIND=VALUE");
  Fault fault;
  fault.kind = text.substr(0, equals);
  const Kind* kind = find(fault.kind);
  if (kind == nullptr) return bad("is of no known kind");
  const char* first = text.data() + equals + 1;
  const auto [end, error] = std::from_chars(first, text.data() + text.size(), fault.value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(fault.value))
    return bad("has no number as its value");
  if (std::abs(fault.value) > kind->most)
    return bad("is larger than " + std::to_string(kind->most));
  return fault;
}

StereoRig told_rig(StereoRig rig, const std::vector<Fault>& faults) {
  using Eigen::Vector3d;
  for (const Fault& f : faults) {
    auto right = rig.T_left_right.linear();
    auto mount = rig.T_map_camera_at_zero.linear();
    if (f.kind == "toe_in") right = about(Vector3d::UnitY(), f.value) * right;
    if (f.kind == "roll") right = about(Vector3d::UnitZ(), f.value) * right;
    if (f.kind == "pitch") right = about(Vector3d::UnitX(), f.value) * right;
    if (f.kind == "tilt") mount = about(Vector3d::UnitY(), f.value) * mount;
    if (f.kind == "yaw") mount = about(Vector3d::UnitZ(), f.value) * mount;
    if (f.kind == "height") rig.T_map_camera_at_zero.translation().z() += f.value;
    if (f.kind == "baseline") rig.T_left_right.translation().x() += f.value;
    if (f.kind == "principal") rig.right.cx_px += f.value;
    for (CameraModel* c : {&rig.left, &rig.right}) {
      if (f.kind == "focal") c->fx_px *= 1 + f.value, c->fy_px *= 1 + f.value;
      if (f.kind == "distortion") c->k1 += f.value;
    }
  }
  return rig;
}

void spoil(std::vector<RecordedDistance>& readings, const std::vector<Fault>& faults, bool cart,
           TimeNs middle) {
  if (readings.empty()) return;
  const auto nearest = std::min_element(
      readings.begin(), readings.end(), [&](const RecordedDistance& a, const RecordedDistance& b) {
        return std::abs(a.time - middle) < std::abs(b.time - middle);
      });
  const auto hit = nearest - readings.begin();
  for (const Fault& f : faults) {
    const bool trolley = f.kind.starts_with(kTrolley);
    if (trolley == cart) continue;
    const std::string kind = trolley ? f.kind.substr(kTrolley.size()) : f.kind;
    for (std::size_t i = 0; i < readings.size(); ++i) {
      RecordedDistance& r = readings[i];
      const auto from_hit = static_cast<std::ptrdiff_t>(i) - hit;
      if (kind == "zero" && from_hit >= 0 && double(from_hit) < f.value) r.distance_m = 0;
      if (kind == "outlier" && from_hit == 0) r.distance_m += f.value;
      if (kind == "jump" && r.time >= middle) r.distance_m += f.value;
      if (kind == "offset") r.distance_m += f.value;
      if (kind == "scale") r.distance_m *= 1 + f.value;
      if (kind == "direction") r.distance_m = f.value - r.distance_m;
      if (kind == "delay") r.time += std::llround(f.value * 1e6);
    }
    if (kind == "drop_out")
      std::erase_if(readings, [&](const RecordedDistance& r) {
        return std::abs(double(r.time - middle)) * 1e-9 < f.value / 2;
      });
  }
}

}  // namespace crane
