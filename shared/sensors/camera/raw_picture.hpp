// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "imaging/pixel_format.hpp"
#include "sensors/camera/frame_source.hpp"

namespace crane {

/// How a camera lays out its pixels, whoever connects it.
struct RawFormat {
  PixelFormat pixels = PixelFormat::kMono8;  ///< as they are handed on
  bool swap_bytes = false;                   ///< two by two, to be so: UYVY
  bool operator==(const RawFormat&) const = default;
};

/// As GenICam's PixelFormat names it (SFNC, and the older names).
std::optional<RawFormat> raw_format_of(std::string_view genicam_name);
/// By its number in the Pixel Format Naming Convention, which stands in every picture.
std::optional<RawFormat> raw_format_of(std::uint32_t pfnc);
std::string known_raw_formats();

/// One picture as it lies in memory.
struct RawPicture {
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;
  std::size_t row_bytes = 0;  ///< 0: rows follow each other without padding
  std::uint32_t width = 0, height = 0;
  RawFormat format;
};

/// Puts a picture into `out`: whole into `left` where there is no right buffer, else its left and
/// right half (`swap`: the other way round). As it is: nothing is converted. Sizes and format go to
/// `facts`.
/// Error: WrongSize where it has fewer bytes than it says, has no halves, or does not fit.
Result<void> unpack(const RawPicture& picture, bool swap, const std::string& name,
                    const FrameBuffers& out, FrameFacts& facts);

/// Whether the pair that was put there is surely the other way round (halves_swapped); never said
/// of pixels that share bytes.
bool pair_swapped(const FrameBuffers& pair, const FrameFacts& facts);

}  // namespace crane
