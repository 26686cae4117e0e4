// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "imaging/image.hpp"

namespace crane {

/// Decodes a PNG or JPEG file of at most 64 MiB; images of more than max_pixels are refused.
/// Pixels are as stored, whatever orientation the file's metadata ask for; what follows the end of
/// the image is ignored. `bits`: how many lower bits of a 16-bit PNG the camera fills, 8 .. 16; 0 =
/// not known.
/// Error: BadData for a file that is missing, truncated, damaged, or no grey or colour image;
/// Configuration where `bits` must be said, or is too low.
Result<Image> read_image(const std::string& path, std::uint64_t max_pixels, int bits = 0);
Result<Image> decode_image(const std::vector<std::uint8_t>& file, const std::string& name,
                           std::uint64_t max_pixels, int bits = 0);

/// A file's bytes: "png" (lossless) or "jpg". Error: Resource.
Result<std::vector<std::uint8_t>> encode_image(const Image& image, const std::string& format,
                                               int jpeg_quality = 95);
/// Writes by extension: .png or .jpg (quality 95). Error: Resource.
Result<void> write_image(const std::string& path, const Image& image);

/// PNG of 16 bits whose values are as they are; who reads it must be told how many bits count.
Result<std::vector<std::uint8_t>> encode_deep(const DeepImage& image);

}  // namespace crane
