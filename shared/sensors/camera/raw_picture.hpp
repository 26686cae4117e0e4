#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "sensors/camera/frame_source.hpp"

namespace crane {

/// How a camera lays out its pixels, whoever connects it.
enum class RawFormat { kMono8, kRgb8, kBgr8, kYuyv, kUyvy };

/// As GenICam's PixelFormat names it (SFNC, and the older names).
std::optional<RawFormat> raw_format_of(std::string_view genicam_name);
/// By its number in the Pixel Format Naming Convention, which stands in every picture.
std::optional<RawFormat> raw_format_of(std::uint32_t pfnc);
std::string known_raw_formats();
/// Of a pixel, in memory.
std::size_t bytes_per_raw_pixel(RawFormat format);

/// Of a pixel, as unpack() hands it on.
std::size_t unpacked_bytes(RawFormat format);

/// One picture as it lies in memory.
struct RawPicture {
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;
  std::size_t row_bytes = 0;  ///< 0: rows follow each other without padding
  std::uint32_t width = 0, height = 0;
  RawFormat format = RawFormat::kMono8;
};

/// Puts a picture into `out`: whole into `left` where there is no right buffer, else its left and
/// right half (`swap`: the other way round). Mono, or BGR where it has three colours a pixel; of
/// YUV only the luma, which is measured at every pixel. Sizes and channels go to `facts`.
/// Error: WrongSize where it has fewer bytes than it says, or does not fit.
Result<void> unpack(const RawPicture& picture, bool swap, const std::string& name,
                    const FrameBuffers& out, FrameFacts& facts);

}  // namespace crane
