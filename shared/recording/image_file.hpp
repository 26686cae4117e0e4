#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// 8-bit image in memory: rows from the top without padding, 1 (mono) or 3 (BGR) channels.
struct Image {
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> bytes;
};

/// Decodes a PNG or JPEG file of at most 64 MiB; images of more than max_pixels are refused.
/// Error: BadData for a file that is missing, truncated, or no 8-bit image.
Result<Image> read_image(const std::string& path, std::uint64_t max_pixels);
Result<Image> decode_image(const std::vector<std::uint8_t>& file, const std::string& name,
                           std::uint64_t max_pixels);

/// Writes by extension: .png or .jpg (quality 95). Error: Resource.
Result<void> write_image(const std::string& path, const Image& image);

}  // namespace crane
