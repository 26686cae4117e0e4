// SPDX-License-Identifier: Apache-2.0
#include "ros2_mirror_service.hpp"

int main(int argc, char** argv) {
  return crane::run_ros2_mirror(argc, argv);
}
