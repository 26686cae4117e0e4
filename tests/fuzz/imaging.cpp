// SPDX-License-Identifier: Apache-2.0
// Images as anybody may say them to be: format, size and bytes at will.
#include <cstdint>
#include <vector>

#include "imaging/convert.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const auto format = crane::pixel_format(data[0] % 22U);
  if (!format) return 0;
  // Exactly as many bytes as there are: one more is found by asan.
  const std::vector<std::uint8_t> bytes(data + 3, data + size);
  const crane::ImageView image{*format, data[1], data[2], bytes};
  const auto made = crane::to_image(image);
  const bool fits = crane::image_flaw(*format, image.width, image.height, bytes.size()) == nullptr;
  if (made && !fits) __builtin_trap();
  // But for JPEG, whose bytes may be none, what has the right size is an image; a Bayer pattern is
  // 3 x 3 at least.
  const bool jpeg = *format == crane::PixelFormat::kJpeg;
  const bool pattern = image.width > 2 && image.height > 2;
  if (!made && fits && !jpeg && pattern) __builtin_trap();
  if (made && (made->width != image.width || made->height != image.height ||
               made->bytes.size() != std::size_t{made->width} * made->height * made->channels))
    __builtin_trap();
  std::vector<std::uint8_t> grey;
  if (!jpeg && pattern && bool(crane::to_grey(image, grey)) != fits) __builtin_trap();
  return 0;
}
