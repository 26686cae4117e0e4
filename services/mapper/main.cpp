// SPDX-License-Identifier: Apache-2.0
#include "mapper/mapper_service.hpp"

int main(int argc, char** argv) {
  return crane::run_mapper(argc, argv);
}
