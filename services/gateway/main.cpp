// SPDX-License-Identifier: Apache-2.0
#include "gateway_service.hpp"

int main(int argc, char** argv) {
  return crane::run_gateway(argc, argv);
}
