// SPDX-License-Identifier: Apache-2.0
// Pictures as cameras lay them out in memory, of any size, padding and format, taken apart.
#include <cstdint>
#include <vector>

#include "sensors/camera/raw_picture.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 5) return 0;
  const bool single = (data[0] & 0x80U) != 0;
  const bool swap = (data[0] & 0x40U) != 0;
  // What the picture says of itself need not be what it has, nor what there is room for.
  const crane::RawPicture picture{
      data + 5,
      size - 5,
      data[3],
      (data[0] & 0x20U) != 0 ? 0xFFFF'FF00U + data[1] : data[1],
      (data[0] & 0x10U) != 0 ? 0xFFFF'FF00U + data[2] : data[2],
      {static_cast<crane::PixelFormat>(1 + data[0] % 18), (data[1] & 1U) != 0}};
  const std::size_t pixels = data[4] * std::size_t{16};
  std::vector<std::uint8_t> left(pixels * 3), right = left;
  crane::FrameFacts facts;
  const auto done =
      crane::unpack(picture, swap, "fuzz",
                    {left.data(), single ? nullptr : right.data(), left.size(), pixels}, facts);
  if (!done) return 0;
  if (facts.width != picture.width / (single ? 1 : 2) || facts.height != picture.height ||
      std::size_t{facts.width} * facts.height > pixels)
    __builtin_trap();
  return 0;
}
