// SPDX-License-Identifier: Apache-2.0
#include "recording/image_file.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>

// jpeglib.h needs cstdio before it.
#include <jpeglib.h>

#include "recording/truth.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using test::TempFolder;
using Bytes = std::vector<std::uint8_t>;
constexpr std::uint64_t kPixels = 1'000'000;

Bytes bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Bytes rig_jpeg() {
  return bytes_of(test::rig_recording() + "/cam0/data/1700000000000000000.jpg");
}

Bytes insert(Bytes file, std::size_t at, const Bytes& more) {
  file.insert(file.begin() + std::ptrdiff_t(at), more.begin(), more.end());
  return file;
}

/// No two rows or columns alike, so that a turned image is another one.
Image picture(std::uint32_t channels) {
  Image image{64, 48, channels, {}};
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width * channels; ++x)
      image.bytes.push_back(static_cast<std::uint8_t>(3 * x + 5 * y + x * y / 7));
  return image;
}

Bytes png(std::uint32_t channels) {
  const TempFolder folder;
  EXPECT_TRUE(write_image(folder / "a.png", picture(channels)));
  return bytes_of(folder / "a.png");
}

/// By libjpeg itself; `progressive` in several scans.
Bytes jpeg(const Image& image, bool progressive) {
  jpeg_compress_struct c{};
  jpeg_error_mgr errors{};
  c.err = jpeg_std_error(&errors);
  jpeg_create_compress(&c);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &out, &size);
  c.image_width = image.width;
  c.image_height = image.height;
  c.input_components = static_cast<int>(image.channels);
  c.in_color_space = image.channels == 3 ? JCS_EXT_BGR : JCS_GRAYSCALE;
  jpeg_set_defaults(&c);
  if (progressive) jpeg_simple_progression(&c);
  jpeg_start_compress(&c, TRUE);
  while (c.next_scanline < c.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(image.bytes.data()) +
                   std::size_t{image.width} * image.channels * c.next_scanline;
    jpeg_write_scanlines(&c, &row, 1);
  }
  jpeg_finish_compress(&c);
  Bytes file(out, out + size);
  jpeg_destroy_compress(&c);
  std::free(out);
  return file;
}

/// The TIFF part of Exif with an orientation alone.
Bytes orientation(std::uint8_t value, bool big_endian) {
  if (big_endian)
    return {'M', 'M', 0, 42, 0, 0, 0,     8, 0, 1, 1, 0x12, 0,
            3,   0,   0, 0,  1, 0, value, 0, 0, 0, 0, 0,    0};
  return {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, value, 0, 0, 0, 0, 0, 0, 0};
}

std::uint32_t crc_of(const Bytes& bytes) {
  std::uint32_t crc = ~0U;
  for (const std::uint8_t b : bytes) {
    crc ^= b;
    for (int i = 0; i < 8; ++i) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

void add_be32(Bytes& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(v >> shift));
}

Bytes png_chunk(const std::string& type, const Bytes& data) {
  Bytes typed(type.begin(), type.end());
  typed.insert(typed.end(), data.begin(), data.end());
  Bytes out;
  add_be32(out, static_cast<std::uint32_t>(data.size()));
  out.insert(out.end(), typed.begin(), typed.end());
  add_be32(out, crc_of(typed));
  return out;
}

void expect_refused(const Bytes& file, const std::string& says = "") {
  const auto image = decode_image(file, "cam0/data/5.jpg", kPixels);
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::kBadData);
  EXPECT_EQ(image.error().where, "cam0/data/5.jpg");
  EXPECT_NE(image.error().text().find(says), std::string::npos) << image.error().text();
}

/// A calibration is of the pixels as they are stored.
TEST(ImageFile, PixelsAreAsStoredWhateverOrientationTheFileAsksFor) {
  for (const bool big_endian : {false, true})
    for (std::uint8_t value = 0; value <= 9; ++value) {
      const Bytes tiff = orientation(value, big_endian);
      Bytes app1 = {0xFF, 0xE1, 0, static_cast<std::uint8_t>(tiff.size() + 8), 'E', 'x', 'i',
                    'f',  0,    0};
      app1.insert(app1.end(), tiff.begin(), tiff.end());
      for (const std::uint32_t channels : {1U, 3U}) {
        const Bytes plain = jpeg(picture(channels), false);
        const auto turned = decode_image(insert(plain, 2, app1), "x", kPixels);
        ASSERT_TRUE(turned) << turned.error().text();
        EXPECT_EQ(turned->width, 64U);
        EXPECT_EQ(turned->bytes, decode_image(plain, "x", kPixels)->bytes);
        const auto as_png =
            decode_image(insert(png(channels), 33, png_chunk("eXIf", tiff)), "x", kPixels);
        ASSERT_TRUE(as_png) << as_png.error().text();
        EXPECT_EQ(as_png->bytes, picture(channels).bytes);
      }
    }
}

TEST(ImageFile, WhatFollowsTheEndIsIgnored) {
  const Bytes trailers[] = {{'d', 'h', 'a', 'v', 0x59, 0x19, 1, 0},
                            Bytes(100, 0),
                            {0xFF, 0xD9},
                            {0xFF},
                            rig_jpeg()};  // a preview
  for (const Bytes& trailer : trailers)
    for (const Bytes& whole : {rig_jpeg(), png(3), jpeg(picture(1), true)}) {
      const auto image = decode_image(insert(whole, whole.size(), trailer), "x", kPixels);
      ASSERT_TRUE(image) << image.error().text();
      EXPECT_EQ(image->bytes, decode_image(whole, "x", kPixels)->bytes);
    }
}

TEST(ImageFile, RefusesATruncatedImageAtAnyLength) {
  for (const Bytes& whole : {rig_jpeg(), png(3), png(1), jpeg(picture(3), true)}) {
    ASSERT_TRUE(decode_image(whole, "x", kPixels));
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 50)
      expect_refused({whole.begin(), whole.begin() + std::ptrdiff_t(size)});
    expect_refused({whole.begin(), whole.end() - 1});
  }
}

/// The rest of such an image is made up by the decoder: grey, or the last block again.
TEST(ImageFile, RefusesACutImageWithAnEndMarkerGluedOn) {
  for (const bool progressive : {false, true}) {
    const Bytes whole = progressive ? jpeg(picture(3), true) : rig_jpeg();
    const std::size_t first = progressive ? whole.size() / 4 : 1000;
    for (std::size_t size = first; size + 8 < whole.size(); size += 1 + whole.size() / 97)
      for (const Bytes& glue : {Bytes{0xFF, 0xD9}, Bytes{0xFF, 0xD9, 0, 0, 0, 0, 'x'}}) {
        Bytes cut(whole.begin(), whole.begin() + std::ptrdiff_t(size));
        expect_refused(insert(cut, cut.size(), glue));
      }
  }
  const Bytes end = png_chunk("IEND", {});
  const Bytes whole = png(3);
  for (std::size_t size = 40; size + 16 < whole.size(); size += 1 + whole.size() / 31) {
    const Bytes cut(whole.begin(), whole.begin() + std::ptrdiff_t(size));
    expect_refused(insert(cut, cut.size(), end));
  }
}

TEST(ImageFile, RefusesAPieceOverwrittenInTheMiddleOfAPng) {
  Bytes damaged = png(3);
  for (std::size_t i = 0; i < 4; ++i) damaged[damaged.size() / 2 + i] ^= 0xFFU;
  expect_refused(damaged);
}

TEST(ImageFile, RefusesMorePixelsThanAFrameHoldsBeforeItTakesTheirMemory) {
  for (const Bytes& file : {rig_jpeg(), png(1)}) {
    const auto image = decode_image(file, "x", 1000);
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().what.find("at most 1000 pixels"), std::string::npos);
  }
  Bytes huge = jpeg(picture(1), false);
  for (std::size_t i = 0; i + 9 < huge.size(); ++i)
    if (huge[i] == 0xFF && huge[i + 1] == 0xC0)
      huge[i + 5] = huge[i + 6] = huge[i + 7] = huge[i + 8] = 0xF0;
  expect_refused(huge, "61680 x 61680 pixels");
}

/// Each scan costs a pass over all pixels: a few bytes must not hold a camera up for minutes.
TEST(ImageFile, RefusesAJpegOfCountlessScans) {
  Bytes file = jpeg(picture(1), true);
  std::size_t scan = 0;
  for (std::size_t i = 2; i + 4 < file.size() && scan == 0;
       i += 2 + (file[i + 2] << 8U) + file[i + 3])
    if (file[i + 1] == 0xDA) scan = i;
  ASSERT_GT(scan, 0U);
  // A refinement scan of one coefficient, over and over.
  Bytes many(file.begin(), file.end() - 2);
  for (int i = 0; i < 5000; ++i) {
    const Bytes again = {0xFF, 0xDA, 0, 8, 1, 1, 0x00, 0, 0, 0x10, 0x00};
    many.insert(many.end(), again.begin(), again.end());
  }
  expect_refused(insert(many, many.size(), {0xFF, 0xD9}));
}

/// Of 16 bits in a file only those count that the camera fills: dropping the lower byte left a
/// camera of 12 bits with 4 of them.
TEST(ImageFile, ScalesSixteenBitFilesByTheDepthOfTheCamera) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    const TempFolder folder;
    HeightMap values;  // written as a 16-bit PNG
    values.columns = 64;
    values.rows = 32;
    const unsigned most = (1U << static_cast<unsigned>(bits)) - 1;
    for (unsigned i = 0; i < 64 * 32; ++i)
      values.height_mm.push_back(static_cast<std::uint16_t>(most * i / (64 * 32 - 1)));
    ASSERT_TRUE(write_height_map(folder / "a.png", values));
    const auto image = read_image(folder / "a.png", kPixels, bits);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->channels, 1U);
    for (std::size_t i = 0; i < image->bytes.size(); ++i)
      ASSERT_EQ(image->bytes[i], values.height_mm[i] >> (bits - 8));
    EXPECT_EQ(image->bytes.back(), 255);
    // Nobody guesses: a picture in the dark looks as one of fewer bits.
    const auto unsaid = read_image(folder / "a.png", kPixels);
    ASSERT_FALSE(unsaid);
    EXPECT_EQ(unsaid.error().code, ErrorCode::kConfiguration);
    EXPECT_NE(unsaid.error().text().find("bits: 12"), std::string::npos) << unsaid.error().text();
    EXPECT_NE(unsaid.error().text().find("largest value is " + std::to_string(most)),
              std::string::npos)
        << unsaid.error().text();
    if (bits > 8) {
      const auto too_few = read_image(folder / "a.png", kPixels, bits - 2);
      ASSERT_FALSE(too_few);
      EXPECT_NE(too_few.error().text().find("sensor.yaml says bits"), std::string::npos);
    }
  }
}

TEST(ImageFile, EightBitFilesAreAsTheyAreWhateverTheDepthOfTheCamera) {
  EXPECT_EQ(decode_image(png(1), "x", kPixels, 12)->bytes, picture(1).bytes);
  EXPECT_EQ(decode_image(png(3), "x", kPixels, 0)->bytes, picture(3).bytes);
}

}  // namespace
}  // namespace crane
