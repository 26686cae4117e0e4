// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_json.hpp"

#include <openssl/evp.h>

#include <algorithm>

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
  const std::size_t at = out.size();
  out.resize(at + 4 * ((data.size() + 2) / 3) + 1);  // and a zero
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data() + at),
                                     reinterpret_cast<const unsigned char*>(data.data()),
                                     static_cast<int>(data.size()));
  out.resize(at + std::size_t(length));
  return out + "\"}";
}

}  // namespace crane::gateway::foxglove
