// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.hpp"
#include "imaging/image.hpp"

namespace crane {

bool is_jpeg(std::span<const std::uint8_t> file);

/// Pixels as they are stored: Exif, in whatever orientation, is not looked at, for a calibration is
/// of the stored pixels. Bytes after the end marker are ignored. What libjpeg would fill in, the
/// rest of an image whose data end early, is no image.
/// Error: BadData for data that are cut, damaged, or not grey or colour of 8 bits.
Result<Image> decode_jpeg(std::span<const std::uint8_t> file, const std::string& name,
                          std::uint64_t max_pixels);

}  // namespace crane
