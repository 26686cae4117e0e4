// SPDX-License-Identifier: Apache-2.0
#include "imaging/convert.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "imaging/jpeg.hpp"

namespace crane {
namespace {

/// The upper 8 bits of values of 10, four in five bytes from the low bits on.
void unpack_10(const std::uint8_t* from, std::size_t pixels, std::uint8_t* to) {
  for (const std::uint8_t* end = to + pixels; to < end; from += 5, to += 4) {
    to[0] = static_cast<std::uint8_t>(from[0] >> 2U | from[1] << 6U);
    to[1] = static_cast<std::uint8_t>(from[1] >> 4U | from[2] << 4U);
    to[2] = static_cast<std::uint8_t>(from[2] >> 6U | from[3] << 2U);
    to[3] = from[4];
  }
}

/// Of 12, two in three bytes.
void unpack_12(const std::uint8_t* from, std::size_t pixels, std::uint8_t* to) {
  for (const std::uint8_t* end = to + pixels; to < end; from += 3, to += 2) {
    to[0] = static_cast<std::uint8_t>(from[0] >> 4U | from[1] << 4U);
    to[1] = from[2];
  }
}

/// The same with 8 bits a value.
PixelFormat with_8_bits(PixelFormat format) {
  const auto after = [&](PixelFormat first, PixelFormat first_8) {
    return static_cast<PixelFormat>(static_cast<std::uint32_t>(format) -
                                    static_cast<std::uint32_t>(first) +
                                    static_cast<std::uint32_t>(first_8));
  };
  if (format == PixelFormat::kMono10p || format == PixelFormat::kMono12p)
    return PixelFormat::kMono8;
  return bits_per_pixel(format) == 10 ? after(PixelFormat::kBayerRggb10p, PixelFormat::kBayerRggb8)
                                      : after(PixelFormat::kBayerRggb12p, PixelFormat::kBayerRggb8);
}

/// OpenCV's code to grey or BGR; -1: none is needed.
int code_of(PixelFormat format, bool grey) {
  switch (format) {
    case PixelFormat::kBgr8:
      return grey ? cv::COLOR_BGR2GRAY : -1;
    case PixelFormat::kRgb8:
      return grey ? cv::COLOR_RGB2GRAY : cv::COLOR_RGB2BGR;
    case PixelFormat::kYuyv:
      return grey ? cv::COLOR_YUV2GRAY_YUY2 : cv::COLOR_YUV2BGR_YUY2;
    // OpenCV names the pattern by the second row's second and third pixel.
    case PixelFormat::kBayerRggb8:
      return grey ? cv::COLOR_BayerBG2GRAY : cv::COLOR_BayerBG2BGR;
    case PixelFormat::kBayerGrbg8:
      return grey ? cv::COLOR_BayerGB2GRAY : cv::COLOR_BayerGB2BGR;
    case PixelFormat::kBayerGbrg8:
      return grey ? cv::COLOR_BayerGR2GRAY : cv::COLOR_BayerGR2BGR;
    case PixelFormat::kBayerBggr8:
      return grey ? cv::COLOR_BayerRG2GRAY : cv::COLOR_BayerRG2BGR;
    default:
      return grey ? -1 : cv::COLOR_GRAY2BGR;
  }
}

Result<void> convert(const ImageView& image, bool grey, std::vector<std::uint8_t>& out) {
  if (const char* flaw = image_flaw(image.format, image.width, image.height, image.bytes.size()))
    return Error{ErrorCode::kWrongSize, name_of(image.format), flaw,
                 "the camera's width, height and format must be those of its frames"};
  if (image.format == PixelFormat::kJpeg)
    return Error{ErrorCode::kBadData, "jpeg", "is decoded before it is converted", ""};
  const std::size_t pixels = std::size_t{image.width} * image.height;
  const std::uint8_t* from = image.bytes.data();
  PixelFormat format = image.format;
  std::vector<std::uint8_t> unpacked;
  if (const std::uint32_t bits = bits_per_pixel(format); bits % 8 != 0) {
    unpacked.resize(pixels);
    (bits == 10 ? unpack_10 : unpack_12)(from, pixels, unpacked.data());
    from = unpacked.data();
    format = with_8_bits(format);
  }
  out.resize(grey ? pixels : 3 * pixels);
  const int code = code_of(format, grey);
  if (code < 0) {
    std::copy_n(from, out.size(), out.begin());
    return {};
  }
  const cv::Size size(static_cast<int>(image.width), static_cast<int>(image.height));
  const cv::Mat raw(size, CV_8UC(static_cast<int>(bytes_per_pixel(format))),
                    const_cast<std::uint8_t*>(from));
  const cv::Mat target(size, grey ? CV_8UC1 : CV_8UC3, out.data());
  try {
    cv::cvtColor(raw, target, code);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, name_of(image.format), "OpenCV: " + e.err, ""};
  }
  return {};
}

}  // namespace

Result<void> to_grey(const ImageView& image, std::vector<std::uint8_t>& grey) {
  return convert(image, true, grey);
}

Result<void> to_bgr(const ImageView& image, std::vector<std::uint8_t>& bgr) {
  return convert(image, false, bgr);
}

Result<ImageView> decoded(const ImageView& image, Image& memory) {
  if (image.format != PixelFormat::kJpeg) return image;
  if (const char* flaw = image_flaw(image.format, image.width, image.height, image.bytes.size()))
    return Error{ErrorCode::kWrongSize, "jpeg", flaw, ""};
  auto made = decode_jpeg(image.bytes, "jpeg", std::uint64_t{image.width} * image.height);
  if (!made) return made.error();
  if (made->width != image.width || made->height != image.height)
    return Error{ErrorCode::kWrongSize, "jpeg",
                 "shows " + std::to_string(made->width) + " x " + std::to_string(made->height) +
                     " pixels, its frame says " + std::to_string(image.width) + " x " +
                     std::to_string(image.height),
                 "the camera's width and height must be those of its images"};
  memory = std::move(*made);
  return memory.view();
}

Result<Image> to_image(const ImageView& image) {
  Image memory;
  const auto plain = decoded(image, memory);
  if (!plain) return plain.error();
  Image out{plain->width, plain->height, may_have_colour(plain->format) ? 3U : 1U, {}};
  const auto done = out.channels == 3 ? to_bgr(*plain, out.bytes) : to_grey(*plain, out.bytes);
  if (!done) return done.error();
  return out;
}

Result<DeepImage> to_deep(const ImageView& image) {
  if (!is_deep_grey(image.format))
    return Error{ErrorCode::kConfiguration, name_of(image.format),
                 "is not grey of more than 8 bits", ""};
  if (const char* flaw = image_flaw(image.format, image.width, image.height, image.bytes.size()))
    return Error{ErrorCode::kWrongSize, name_of(image.format), flaw,
                 "the camera's width, height and format must be those of its frames"};
  const auto bits = std::size_t{bits_per_pixel(image.format)};
  DeepImage out{image.width, image.height, static_cast<int>(bits), {}};
  out.values.resize(std::size_t{image.width} * image.height);
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    const std::size_t at = i * bits;  // a value begins in one byte and ends in the next
    const unsigned both = image.bytes[at / 8] | unsigned{image.bytes[at / 8 + 1]} << 8U;
    out.values[i] = static_cast<std::uint16_t>(both >> at % 8 & ((1U << bits) - 1));
  }
  return out;
}

}  // namespace crane
