#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "imaging/convert.hpp"

namespace crane {

/// 8-bit image in memory: rows from the top without padding, 1 (mono) or 3 (BGR) channels.
struct Image {
  std::uint32_t width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] ImageView view() const {
    return {format_of_channels(channels), width, height, bytes};
  }
};

/// Decodes a PNG or JPEG file of at most 64 MiB; images of more than max_pixels are refused.
/// Pixels are as stored, whatever orientation the file's metadata ask for; what follows the end of
/// the image is ignored. `bits`: how many lower bits of a 16-bit PNG the camera fills, 8 .. 16; 0 =
/// not known.
/// Error: BadData for a file that is missing, truncated, damaged, or no grey or colour image;
/// Configuration where `bits` must be said, or is too low.
Result<Image> read_image(const std::string& path, std::uint64_t max_pixels, int bits = 0);
Result<Image> decode_image(const std::vector<std::uint8_t>& file, const std::string& name,
                           std::uint64_t max_pixels, int bits = 0);

Error too_many_pixels(const std::string& name, std::uint64_t width, std::uint64_t height,
                      std::uint64_t max_pixels);

/// Writes by extension: .png or .jpg (quality 95). Error: Resource.
Result<void> write_image(const std::string& path, const Image& image);

}  // namespace crane
