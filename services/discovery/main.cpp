// SPDX-License-Identifier: Apache-2.0
#include "discovery_service.hpp"

int main(int argc, char** argv) {
  return crane::run_discovery(argc, argv);
}
