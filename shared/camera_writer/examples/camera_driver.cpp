// SPDX-License-Identifier: Apache-2.0
// A camera driver: what your camera's library gives becomes topic stereo_frame. Here two grey
// pictures (PGM) stand for the camera, 10 times a second.
// usage: cranemap-example-camera-driver LEFT.pgm RIGHT.pgm [DOMAIN [FRAMES]]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include <crane/camera/writer.hpp>

static bool grab(const char* file, crane::camera::Options& o, std::vector<std::uint8_t>& pixels) {
  std::FILE* f = std::fopen(file, "rb");
  const bool good =
      f && std::fscanf(f, "P5 %u %u 255", &o.width, &o.height) == 2 && std::fgetc(f) != EOF;
  pixels.resize(good ? std::size_t{o.width} * o.height : 0);
  const bool whole = good && std::fread(pixels.data(), 1, pixels.size(), f) == pixels.size();
  if (f) std::fclose(f);
  return whole;
}

int main(int argc, char** argv) {
  crane::camera::Options options;
  std::vector<std::uint8_t> left, right;
  if (argc < 3 || !grab(argv[1], options, left) || !grab(argv[2], options, right) ||
      left.size() != right.size())
    return std::fprintf(stderr, "usage: %s LEFT.pgm RIGHT.pgm [DOMAIN [FRAMES]]\n", argv[0]), 2;
  if (argc > 3) options.domain = static_cast<std::uint32_t>(std::atoi(argv[3]));
  std::string error;
  const auto writer = crane::camera::Writer::open(options, error);
  if (!writer) return std::fprintf(stderr, "%s\n", error.c_str()), 3;
  for (long n = argc > 4 ? std::atol(argv[4]) : -1; n != 0; --n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the next exposure
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto time = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
    if (const auto pair = writer->loan()) {
      std::copy(left.begin(), left.end(), pair.left);
      std::copy(right.begin(), right.end(), pair.right);
      if (!writer->publish(time, error)) std::fprintf(stderr, "%s\n", error.c_str());
    } else {
      writer->missed(1);
    }
  }
}
