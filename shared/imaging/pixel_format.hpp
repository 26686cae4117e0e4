// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace crane {

/// How the bytes of an image say its pixels. The numbers are those of ENCODING_* in
/// idl/v1/bounds.idl.
enum class PixelFormat : std::uint32_t {
  kMono8 = 1,
  kBgr8 = 2,
  kRgb8 = 3,
  kYuyv = 4,        ///< Y U Y V, BT.601; width even
  kBayerRggb8 = 5,  ///< the first two pixels of the first two rows
  kBayerGrbg8 = 6,
  kBayerGbrg8 = 7,
  kBayerBggr8 = 8,
  kMono10p = 9,  ///< GenICam PFNC: values one after the other from the low bits on
  kMono12p = 10,
  kBayerRggb10p = 11,
  kBayerGrbg10p = 12,
  kBayerGbrg10p = 13,
  kBayerBggr10p = 14,
  kBayerRggb12p = 15,
  kBayerGrbg12p = 16,
  kBayerGbrg12p = 17,
  kBayerBggr12p = 18,
  kJpeg = 19,
};

/// Largest image, whichever way it stands: 2448 x 2048 (5 MP).
inline constexpr std::uint32_t kMaxImagePixels = 2448 * 2048;
/// Largest image in bytes: three of each pixel.
inline constexpr std::size_t kMaxImageBytes = std::size_t{3} * kMaxImagePixels;

std::optional<PixelFormat> pixel_format(std::uint32_t encoding);
/// Of an image in memory: 3 channels are BGR, one is grey.
constexpr PixelFormat format_of_channels(std::uint32_t channels) {
  return channels == 3 ? PixelFormat::kBgr8 : PixelFormat::kMono8;
}

/// "mono8", "bayer_rggb10p".
const char* name_of(PixelFormat format);

/// Bits of a pixel; 0 for JPEG.
std::uint32_t bits_per_pixel(PixelFormat format);

/// 1, 2 or 3; 0 for JPEG and where pixels share bytes.
std::uint32_t bytes_per_pixel(PixelFormat format);

/// Whether colour was measured: of JPEG only its decoder knows, true.
bool may_have_colour(PixelFormat format);

/// Bytes of an image without padding; nothing for JPEG, whose images differ, and for a width that
/// the format cannot have.
std::optional<std::size_t> image_bytes(PixelFormat format, std::uint32_t width,
                                       std::uint32_t height);

/// What is wrong with an image of so many bytes; nullptr: nothing. More bytes than the image are no
/// flaw: they are not looked at.
const char* image_flaw(PixelFormat format, std::uint32_t width, std::uint32_t height,
                       std::size_t bytes);

}  // namespace crane
