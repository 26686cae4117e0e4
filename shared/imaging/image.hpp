// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "imaging/pixel_format.hpp"

namespace crane {

/// An image as a camera gave it: rows from the top without padding; what follows is not looked at.
struct ImageView {
  PixelFormat format = PixelFormat::kMono8;
  std::uint32_t width = 0, height = 0;  ///< [px]
  std::span<const std::uint8_t> bytes;
};

/// 8-bit image in memory: rows from the top without padding, 1 (mono) or 3 (BGR) channels.
struct Image {
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] ImageView view() const {
    return {format_of_channels(channels), width, height, bytes};
  }
};

/// Grey image of more than 8 bits: values below 2^bits, rows from the top without padding.
struct DeepImage {
  std::uint32_t width = 0, height = 0;
  int bits = 16;  ///< 9 .. 16
  std::vector<std::uint16_t> values;
};

Error too_many_pixels(const std::string& name, std::uint64_t width, std::uint64_t height,
                      std::uint64_t max_pixels);

}  // namespace crane
