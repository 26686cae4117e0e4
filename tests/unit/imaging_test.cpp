// SPDX-License-Identifier: Apache-2.0
// What bytes of each pixel format say, against formulas written down anew.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "base/read_file.hpp"
#include "imaging/convert.hpp"
#include "recording/image_file.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint32_t kWidth = 64, kHeight = 48;

/// A smooth coloured scene, so that what a pattern leaves out can be filled in.
struct Colour {
  double b, g, r;
};
Colour scene(std::uint32_t x, std::uint32_t y) {
  return {40 + 1.5 * x, 200 - 1.0 * x - 1.2 * y, 30 + 2.0 * y + 0.5 * x};
}
std::uint8_t byte(double v) {
  return static_cast<std::uint8_t>(std::lround(v));
}
double grey_of(const Colour& c) {
  return 0.299 * c.r + 0.587 * c.g + 0.114 * c.b;
}

/// Colour at each place of the pattern: 0 blue, 1 green, 2 red.
int bayer_channel(PixelFormat format, std::uint32_t x, std::uint32_t y) {
  static constexpr const char* kPatterns[] = {"rggb", "grbg", "gbrg", "bggr"};
  const auto from = [&](PixelFormat first) {
    return static_cast<std::uint32_t>(format) - static_cast<std::uint32_t>(first);
  };
  const std::uint32_t n = format >= PixelFormat::kBayerRggb12p   ? from(PixelFormat::kBayerRggb12p)
                          : format >= PixelFormat::kBayerRggb10p ? from(PixelFormat::kBayerRggb10p)
                                                                 : from(PixelFormat::kBayerRggb8);
  const char c = kPatterns[n][2 * (y % 2) + x % 2];
  return c == 'b' ? 0 : c == 'g' ? 1 : 2;
}

/// Values packed bit by bit, from the low ones on.
Bytes packed(const std::vector<unsigned>& values, unsigned bits) {
  Bytes out(values.size() * bits / 8);
  std::size_t at = 0;
  for (const unsigned v : values)
    for (unsigned b = 0; b < bits; ++b, ++at)
      out[at / 8] = static_cast<std::uint8_t>(out[at / 8] | (v >> b & 1U) << at % 8);
  return out;
}

ImageView view(PixelFormat format, std::span<const std::uint8_t> bytes) {
  return {format, kWidth, kHeight, bytes};
}

TEST(PixelFormats, AllHaveNamesAndBytes) {
  EXPECT_FALSE(pixel_format(0));
  EXPECT_FALSE(pixel_format(20));
  EXPECT_FALSE(pixel_format(0xFFFFFFFF));
  for (std::uint32_t n = 1; n <= 19; ++n) {
    const auto format = pixel_format(n);
    ASSERT_TRUE(format);
    EXPECT_GT(std::string(name_of(*format)).size(), 3U);
    EXPECT_EQ(image_bytes(*format, 64, 48).has_value(), *format != PixelFormat::kJpeg);
  }
  EXPECT_STREQ(name_of(PixelFormat::kBayerBggr12p), "bayer_bggr12p");
  EXPECT_EQ(image_bytes(PixelFormat::kMono10p, 2448, 2048), 2448U * 2048 * 5 / 4);
}

TEST(Convert, ColourFormatsBecomeTheSameGreyAndColour) {
  Bytes bgr, rgb, yuyv;
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      const Colour c = scene(x, y);
      bgr.insert(bgr.end(), {byte(c.b), byte(c.g), byte(c.r)});
      rgb.insert(rgb.end(), {byte(c.r), byte(c.g), byte(c.b)});
      // BT.601, 16 .. 235
      yuyv.push_back(byte(16 + 0.257 * c.r + 0.504 * c.g + 0.098 * c.b));
      const Colour both = scene(x - x % 2, y);
      yuyv.push_back(x % 2 == 0 ? byte(128 - 0.148 * both.r - 0.291 * both.g + 0.439 * both.b)
                                : byte(128 + 0.439 * both.r - 0.368 * both.g - 0.071 * both.b));
    }
  Bytes out;
  for (const auto& [format, bytes] :
       {std::pair{PixelFormat::kBgr8, &bgr}, std::pair{PixelFormat::kRgb8, &rgb}}) {
    ASSERT_TRUE(to_bgr(view(format, *bytes), out));
    EXPECT_EQ(out, bgr);
    ASSERT_TRUE(to_grey(view(format, *bytes), out));
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i)
      ASSERT_NEAR(out[i], grey_of(scene(i % kWidth, i / kWidth)), 1.01);
  }
  ASSERT_TRUE(to_bgr(view(PixelFormat::kYuyv, yuyv), out));
  for (std::size_t i = 0; i < bgr.size(); ++i) ASSERT_NEAR(out[i], bgr[i], 4) << i;
  ASSERT_TRUE(to_grey(view(PixelFormat::kYuyv, yuyv), out));
  for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], yuyv[2 * i]) << "as measured";
}

TEST(Convert, BayerPatternsOfAllDepthsShowTheSceneInItsColours) {
  for (std::uint32_t n = 5; n <= 18; ++n) {
    const PixelFormat format = *pixel_format(n);
    if (!may_have_colour(format)) continue;
    SCOPED_TRACE(name_of(format));
    const std::uint32_t bits = bits_per_pixel(format);
    std::vector<unsigned> raw;
    for (std::uint32_t y = 0; y < kHeight; ++y)
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const Colour c = scene(x, y);
        const double v[3] = {c.b, c.g, c.r};
        raw.push_back(static_cast<unsigned>(
            std::lround(v[bayer_channel(format, x, y)] * double(1U << (bits - 8)))));
      }
    Bytes out;
    const Bytes bytes = packed(raw, bits);
    ASSERT_EQ(bytes.size(), image_bytes(format, kWidth, kHeight));
    ASSERT_TRUE(to_bgr(view(format, bytes), out));
    for (std::uint32_t y = 2; y + 2 < kHeight; ++y)
      for (std::uint32_t x = 2; x + 2 < kWidth; ++x) {
        const Colour c = scene(x, y);
        const std::uint8_t* p = &out[3 * (std::size_t{y} * kWidth + x)];
        ASSERT_NEAR(p[0], c.b, 2) << x << " " << y;
        ASSERT_NEAR(p[1], c.g, 2) << x << " " << y;
        ASSERT_NEAR(p[2], c.r, 2) << x << " " << y;
      }
    ASSERT_TRUE(to_grey(view(format, bytes), out));
    for (std::uint32_t y = 2; y + 2 < kHeight; ++y)
      for (std::uint32_t x = 2; x + 2 < kWidth; ++x)
        ASSERT_NEAR(out[std::size_t{y} * kWidth + x], grey_of(scene(x, y)), 2.5);  // and rounded
  }
}

TEST(Convert, PackedGreyGivesItsUpperEightBits) {
  std::mt19937 random(5);
  for (const auto& [format, bits] :
       {std::pair{PixelFormat::kMono10p, 10U}, std::pair{PixelFormat::kMono12p, 12U}}) {
    std::vector<unsigned> values(kWidth * kHeight);
    for (unsigned& v : values) v = static_cast<unsigned>(random()) % (1U << bits);
    Bytes out;
    ASSERT_TRUE(to_grey(view(format, packed(values, bits)), out));
    for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(out[i], values[i] >> (bits - 8));
    ASSERT_TRUE(to_bgr(view(format, packed(values, bits)), out));
    EXPECT_EQ(out[3 * 100 + 1], values[100] >> (bits - 8));
  }
}

/// As write_image() makes it.
Bytes jpeg_of(const Image& image) {
  const test::TempFolder folder;
  EXPECT_TRUE(write_image(folder / "a.jpg", image));
  const auto file = read_file(folder / "a.jpg", 1U << 20U);
  EXPECT_TRUE(file);
  return {file->begin(), file->end()};
}

TEST(Decoded, JpegShowsWhatWasPutIntoIt) {
  for (const std::uint32_t channels : {1U, 3U}) {
    Image image{kWidth, kHeight, channels, {}};
    for (std::uint32_t y = 0; y < kHeight; ++y)
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const Colour c = scene(x, y);
        if (channels == 1)
          image.bytes.push_back(byte(grey_of(c)));
        else
          image.bytes.insert(image.bytes.end(), {byte(c.b), byte(c.g), byte(c.r)});
      }
    const Bytes file = jpeg_of(image);
    Image memory;
    const auto shown = decoded(view(PixelFormat::kJpeg, file), memory);
    ASSERT_TRUE(shown) << shown.error().text();
    EXPECT_EQ(shown->format, format_of_channels(channels));
    ASSERT_EQ(shown->bytes.size(), image.bytes.size());
    for (std::size_t i = 0; i < image.bytes.size(); ++i)
      ASSERT_NEAR(shown->bytes[i], image.bytes[i], 12);
    const auto stored = to_image(view(PixelFormat::kJpeg, file));
    ASSERT_TRUE(stored);
    EXPECT_EQ(stored->channels, channels);
    // Of another size, cut, damaged, none at all.
    EXPECT_EQ(decoded({PixelFormat::kJpeg, kHeight, kWidth, file}, memory).error().code,
              ErrorCode::kWrongSize);
    EXPECT_FALSE(decoded({PixelFormat::kJpeg, 8, 8, file}, memory));
    for (std::size_t cut = 0; cut < file.size(); cut += 1 + file.size() / 40)
      EXPECT_FALSE(decoded(view(PixelFormat::kJpeg, {file.data(), cut}), memory)) << cut;
    EXPECT_FALSE(to_grey(view(PixelFormat::kJpeg, file), memory.bytes)) << "not decoded";
  }
}

TEST(ToImage, StoresGreyAsGreyAndColourAsBgr) {
  const Bytes bytes(kWidth * kHeight * 3, 100);
  for (std::uint32_t n = 1; n < 19; ++n) {
    const auto image = to_image(view(*pixel_format(n), bytes));
    ASSERT_TRUE(image) << n;
    EXPECT_EQ(image->channels, may_have_colour(*pixel_format(n)) ? 3U : 1U);
    EXPECT_EQ(image->bytes.size(), kWidth * kHeight * image->channels);
  }
}

TEST(Convert, WhatIsNoImageIsRefused) {
  Bytes out;
  const Bytes few(100);
  for (std::uint32_t n = 1; n <= 19; ++n) {
    EXPECT_FALSE(to_grey(view(*pixel_format(n), few), out)) << n;
    EXPECT_FALSE(to_bgr(view(*pixel_format(n), few), out)) << n;
  }
  const Bytes many(64 * 64 * 3);
  EXPECT_FALSE(to_grey({PixelFormat::kYuyv, 63, 48, many}, out));
  EXPECT_FALSE(to_grey({PixelFormat::kMono10p, 62, 48, many}, out));
  EXPECT_FALSE(to_grey({PixelFormat::kMono8, 0, 48, many}, out));
  EXPECT_FALSE(to_grey({PixelFormat::kMono8, 0xFFFFFFFF, 0xFFFFFFFF, many}, out));
  // The smallest there are: nothing beyond them is read or written.
  for (const std::uint32_t n : {1U, 2U, 3U, 5U, 6U, 7U, 8U})
    for (std::uint32_t w = 1; w < 4; ++w)
      for (std::uint32_t h = 1; h < 4; ++h) {
        const Bytes exact(std::size_t{w} * h * bytes_per_pixel(*pixel_format(n)));
        (void)to_bgr({*pixel_format(n), w, h, exact}, out);
        (void)to_grey({*pixel_format(n), w, h, exact}, out);
      }
}

}  // namespace
}  // namespace crane
