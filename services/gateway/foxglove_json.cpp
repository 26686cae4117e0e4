// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_json.hpp"

#include <algorithm>

#include "http/base64.hpp"

namespace crane::gateway::foxglove {

Json stamp(TimeNs time) {
  const TimeNs t = std::max<TimeNs>(time, 0);
  return {{"sec", t / kNsPerSecond}, {"nsec", t % kNsPerSecond}};
}

Json xyz(const Eigen::Vector3d& v) {
  return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}};
}

Json xyzw(const Eigen::Quaterniond& q) {
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}

Json pose_at(const Eigen::Vector3d& origin) {
  return {{"position", xyz(origin)}, {"orientation", xyzw(Eigen::Quaterniond::Identity())}};
}

Json field(const char* name, int offset, int type) {
  return {{"name", name}, {"offset", offset}, {"type", type}};
}

std::string with_data(const Json& message, const std::string& data) {
  std::string out = message.dump();
  out.pop_back();
  out += ",\"data\":\"";
  http::add_base64(out, data);
  return out + "\"}";
}

}  // namespace crane::gateway::foxglove
