// SPDX-License-Identifier: Apache-2.0
#include "imaging/pixel_format.hpp"

#include <array>

namespace crane {
namespace {

struct Row {
  const char* name;
  std::uint32_t bits;        ///< of a pixel; 0: JPEG
  std::uint32_t width_step;  ///< the width is a multiple of it
  bool colour;
};

constexpr std::array<Row, 20> kRows = {{
    {nullptr, 0, 1, false},         {"mono8", 8, 1, false},         {"bgr8", 24, 1, true},
    {"rgb8", 24, 1, true},          {"yuyv", 16, 2, true},          {"bayer_rggb8", 8, 1, true},
    {"bayer_grbg8", 8, 1, true},    {"bayer_gbrg8", 8, 1, true},    {"bayer_bggr8", 8, 1, true},
    {"mono10p", 10, 4, false},      {"mono12p", 12, 2, false},      {"bayer_rggb10p", 10, 4, true},
    {"bayer_grbg10p", 10, 4, true}, {"bayer_gbrg10p", 10, 4, true}, {"bayer_bggr10p", 10, 4, true},
    {"bayer_rggb12p", 12, 2, true}, {"bayer_grbg12p", 12, 2, true}, {"bayer_gbrg12p", 12, 2, true},
    {"bayer_bggr12p", 12, 2, true}, {"jpeg", 0, 1, true},
}};

const Row& row_of(PixelFormat format) {
  return kRows[static_cast<std::uint32_t>(format)];
}

}  // namespace

std::optional<PixelFormat> pixel_format(std::uint32_t encoding) {
  if (encoding == 0 || encoding >= kRows.size()) return std::nullopt;
  return static_cast<PixelFormat>(encoding);
}

const char* name_of(PixelFormat format) {
  return row_of(format).name;
}

std::uint32_t bits_per_pixel(PixelFormat format) {
  return row_of(format).bits;
}

std::uint32_t bytes_per_pixel(PixelFormat format) {
  const std::uint32_t bits = row_of(format).bits;
  return bits % 8 == 0 ? bits / 8 : 0;
}

bool may_have_colour(PixelFormat format) {
  return row_of(format).colour;
}

std::optional<std::size_t> image_bytes(PixelFormat format, std::uint32_t width,
                                       std::uint32_t height) {
  const Row& row = row_of(format);
  if (row.bits == 0 || width % row.width_step != 0) return std::nullopt;
  return std::size_t{width} * row.bits / 8 * height;
}

const char* image_flaw(PixelFormat format, std::uint32_t width, std::uint32_t height,
                       std::size_t bytes) {
  if (width == 0 || height == 0 || width > 65'535 || height > 65'535 ||
      std::uint64_t{width} * height > kMaxImagePixels)
    return "image size out of bounds";
  if (bytes > kMaxImageBytes) return "more bytes than an image may have";
  if (format == PixelFormat::kJpeg) return bytes == 0 ? "an image without a byte" : nullptr;
  const auto needed = image_bytes(format, width, height);
  if (!needed)
    return format == PixelFormat::kYuyv ? "yuyv with an odd width"
                                        : "a width whose rows end within a byte";
  return bytes < *needed ? "fewer bytes than the image needs" : nullptr;
}

}  // namespace crane
