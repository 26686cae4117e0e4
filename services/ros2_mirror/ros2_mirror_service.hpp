// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-ros2-mirror`: what the crane's topics carry, once more as ROS 2's.
int run_ros2_mirror(int argc, char** argv);

}  // namespace crane
