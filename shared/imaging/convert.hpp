// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "imaging/image.hpp"

namespace crane {

/// Grey, 8 bits, width x height: what was measured where that is grey, YUYV's luma, else
/// 0.299 R + 0.587 G + 0.114 B. Of 10 and 12 bits the upper 8.
/// Error: WrongSize, BadData for an image that is not what it says it is; JPEG is decoded first.
Result<void> to_grey(const ImageView& image, std::vector<std::uint8_t>& grey);

/// Blue, green, red, 8 bits each; of a grey camera three times its grey. Bayer patterns bilinearly.
/// Error: as above.
Result<void> to_bgr(const ImageView& image, std::vector<std::uint8_t>& bgr);

/// What a JPEG shows, decoded into `memory`; any other image as it is. Error: WrongSize for another
/// size than it says, BadData for what is cut or damaged.
Result<ImageView> decoded(const ImageView& image, Image& memory);

/// As it is looked at and stored in files: grey of a camera without colour, else BGR. Error: as
/// above.
Result<Image> to_image(const ImageView& image);

/// Every bit of a grey camera of 10 or 12. Error: WrongSize; Configuration for any other format.
Result<DeepImage> to_deep(const ImageView& image);
/// Whether to_deep() takes it.
constexpr bool is_deep_grey(PixelFormat format) {
  return format == PixelFormat::kMono10p || format == PixelFormat::kMono12p;
}

}  // namespace crane
