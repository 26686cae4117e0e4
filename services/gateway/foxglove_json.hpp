// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/clock.hpp"
#include "gateway/json.hpp"
#include "geometry/stereo_rig.hpp"

namespace crane::gateway::foxglove {

// Parts that Foxglove's messages have in common.

inline constexpr int kUint8 = 1, kFloat32 = 7;  ///< foxglove.NumericType

Json stamp(TimeNs time);
Json xyz(const Eigen::Vector3d& v);
Json xyzw(const Eigen::Quaterniond& q);
/// Not turned.
Json pose_at(const Eigen::Vector3d& origin);
Json field(const char* name, int offset, int type);
/// The message with `data` in base64.
std::string with_data(const Json& message, const std::string& data);

}  // namespace crane::gateway::foxglove
