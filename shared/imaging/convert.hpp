#pragma once

#include <cstdint>
#include <span>
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

/// Grey, 8 bits, width x height: what was measured where that is grey, YUYV's luma, else
/// 0.299 R + 0.587 G + 0.114 B. Of 10 and 12 bits the upper 8.
/// Error: WrongSize, BadData for an image that is not what it says it is.
Result<void> to_grey(const ImageView& image, std::vector<std::uint8_t>& grey);

/// Blue, green, red, 8 bits each; of a grey camera three times its grey. Bayer patterns bilinearly.
/// Error: as above.
Result<void> to_bgr(const ImageView& image, std::vector<std::uint8_t>& bgr);

}  // namespace crane
