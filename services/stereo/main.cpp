// SPDX-License-Identifier: Apache-2.0
#include "stereo_service.hpp"

int main(int argc, char** argv) {
  return crane::run_stereo(argc, argv);
}
