// SPDX-License-Identifier: Apache-2.0
#include "camera_service.hpp"

int main(int argc, char** argv) {
  return crane::run_camera(argc, argv);
}
