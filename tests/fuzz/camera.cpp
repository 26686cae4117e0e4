// SPDX-License-Identifier: Apache-2.0
// What a camera or a folder of pictures gives: names, and frames of any length taken apart.
#include <cstdint>
#include <string>
#include <vector>

#include "sensors/camera/folder_device.hpp"
#include "sensors/camera/pair_layout.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)crane::time_of_name({reinterpret_cast<const char*>(data), size});
  if (size < 5) return 0;
  const auto layout = static_cast<crane::PairLayout>(data[0] % 4);
  const bool single = (data[0] & 0x80U) != 0;  // one of two cameras
  const std::uint32_t width = data[1], height = data[2], row_bytes = data[3] * 4U;
  // Exactly as large as a frame of that size may be: a byte more is found by asan.
  std::vector<std::uint8_t> left(std::size_t{width} * height * 3), right = left;
  crane::FrameFacts facts;
  const auto split = crane::split_pair(
      layout, data + 4, size - 4, width, height, row_bytes, "fuzz",
      {left.data(), single ? nullptr : right.data(), left.size(), std::size_t{width} * height},
      facts);
  if (!split) return 0;
  const std::uint32_t pixel = crane::bytes_per_pixel(facts.format);
  if (facts.width != width || facts.height != height || pixel == 0) __builtin_trap();
  (void)crane::repeated_rows(left.data(), width, height, pixel);
  (void)crane::halves_swapped(left.data(), right.data(), width, height, pixel);
  return 0;
}
