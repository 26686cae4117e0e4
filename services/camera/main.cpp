#include "camera_player.hpp"

int main(int argc, char** argv) {
  return crane::run_camera(argc, argv);
}
