// SPDX-License-Identifier: Apache-2.0
#include "clearance_service.hpp"

int main(int argc, char** argv) {
  return crane::run_clearance(argc, argv);
}
