// SPDX-License-Identifier: Apache-2.0
#include "rangefinder_player.hpp"

int main(int argc, char** argv) {
  return crane::run_rangefinder(argc, argv);
}
