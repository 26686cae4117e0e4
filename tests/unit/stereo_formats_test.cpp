// SPDX-License-Identifier: Apache-2.0
// What a camera may give, through the stage: whatever the format, the same depth.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/read_file.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "stereo/stereo_stage.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Pair {
  Image image[2];
  Bytes file[2];
};

Pair rig_pair(const Recording& recording) {
  Pair out;
  const RecordedFrame& frame = recording.frames()[0];
  for (int side = 0; side < 2; ++side) {
    const std::string& path = side == 0 ? frame.left_file : frame.right_file;
    out.image[side] = *read_image(path, kMaxImagePixels);
    const auto file = read_file(path, 64U << 20U);
    out.file[side].assign(file->begin(), file->end());
  }
  return out;
}

Bytes grey_of(const Image& bgr) {
  Bytes grey;
  EXPECT_TRUE(to_grey(bgr.view(), grey));
  return grey;
}

Bytes rgb_of(const Image& bgr) {
  Bytes out = bgr.bytes;
  for (std::size_t i = 0; i < out.size(); i += 3) std::swap(out[i], out[i + 2]);
  return out;
}

Bytes yuyv_of(const Image& bgr) {
  const Bytes grey = grey_of(bgr);
  Bytes out(2 * grey.size(), 128);
  for (std::size_t i = 0; i < grey.size(); ++i) out[2 * i] = grey[i];
  return out;
}

/// One channel a pixel; rows begin with green and blue when `gbrg`, with red and green else.
Bytes bayer_of(const Image& bgr, bool gbrg) {
  Bytes out(std::size_t{bgr.width} * bgr.height);
  for (std::uint32_t y = 0; y < bgr.height; ++y)
    for (std::uint32_t x = 0; x < bgr.width; ++x) {
      const bool green = (x + y) % 2 == (gbrg ? 0 : 1);
      const bool red_row = (y % 2 == 0) != gbrg;
      const std::size_t at = std::size_t{y} * bgr.width + x;
      out[at] = bgr.bytes[3 * at + (green ? 1 : red_row ? 2 : 0)];
    }
  return out;
}

Bytes packed(const Bytes& values, unsigned bits) {
  Bytes out(values.size() * bits / 8);
  std::size_t at = 0;
  for (const std::uint8_t v : values)
    for (unsigned b = 0; b < bits; ++b, ++at) {
      const unsigned bit = unsigned{v} << (bits - 8) >> b & 1U;
      out[at / 8] = static_cast<std::uint8_t>(out[at / 8] | bit << at % 8);
    }
  return out;
}

TEST(StereoFormats, EachGivesTheDepthOfTheSameScene) {
  const auto recording = Recording::open(test::rig_recording());
  ASSERT_TRUE(recording);
  const Pair pair = rig_pair(*recording);
  const std::uint32_t width = pair.image[0].width, height = pair.image[0].height;
  const std::size_t pixels = std::size_t{width} * height;
  auto stage = StereoStage::create(recording->rig(), {});
  ASSERT_TRUE(stage);
  struct Result {
    std::vector<float> depth;
    Bytes confidence, colour;
    std::uint32_t matched = 0;
  };
  constexpr std::int64_t kNumber = 5;  // the same frame again: no camera is frozen
  const auto run = [&](PixelFormat format, const Bytes& left, const Bytes& right) {
    Result out{std::vector<float>(pixels), Bytes(pixels), Bytes(3 * pixels), 0};
    const auto rectified =
        stage->rectify({{format, width, height, left}, {format, width, height, right}, kNumber});
    EXPECT_TRUE(rectified) << name_of(format) << ": " << rectified.error().text();
    const auto report = stage->match({out.depth, out.confidence, out.colour});
    EXPECT_TRUE(report && !report->flaw) << name_of(format);
    if (report) out.matched = report->matched;
    return out;
  };
  const Result best = run(PixelFormat::kBgr8, pair.image[0].bytes, pair.image[1].bytes);
  ASSERT_GT(best.matched, pixels / 2);
  const std::pair<PixelFormat, std::function<Bytes(int)>> formats[] = {
      {PixelFormat::kMono8, [&](int s) { return grey_of(pair.image[s]); }},
      {PixelFormat::kRgb8, [&](int s) { return rgb_of(pair.image[s]); }},
      {PixelFormat::kYuyv, [&](int s) { return yuyv_of(pair.image[s]); }},
      {PixelFormat::kBayerRggb8, [&](int s) { return bayer_of(pair.image[s], false); }},
      {PixelFormat::kBayerGbrg12p,
       [&](int s) { return packed(bayer_of(pair.image[s], true), 12); }},
      {PixelFormat::kMono10p, [&](int s) { return packed(grey_of(pair.image[s]), 10); }},
      {PixelFormat::kJpeg, [&](int s) { return pair.file[s]; }},
  };
  for (const auto& [format, make] : formats) {
    SCOPED_TRACE(name_of(format));
    const Result got = run(format, make(0), make(1));
    EXPECT_GT(got.matched, best.matched * 0.85);
    std::size_t both = 0, differ = 0;
    double colour = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      if (got.depth[i] > 0 && best.depth[i] > 0) {
        ++both;
        differ += std::abs(1 / got.depth[i] - 1 / best.depth[i]) > 1.0 / 84 ? 1 : 0;  // a pixel
      }
      for (std::size_t c = 0; c < 3; ++c)
        colour += std::abs(double(got.colour[3 * i + c]) - best.colour[3 * i + c]);
    }
    EXPECT_GT(both, best.matched * 0.8);
    EXPECT_LT(double(differ), 0.01 * double(both));
    if (may_have_colour(format) && format != PixelFormat::kYuyv) {
      EXPECT_LT(colour / (3.0 * double(pixels)), 10);
    } else {  // three times its grey: there is no colour in it
      for (std::size_t i = 0; i < got.colour.size(); i += 3)
        ASSERT_TRUE(got.colour[i] == got.colour[i + 1] && got.colour[i] == got.colour[i + 2]);
    }
  }
}

TEST(StereoFormats, AnImageThatIsNoneIsRefusedByWhatItIs) {
  const auto recording = Recording::open(test::rig_recording());
  ASSERT_TRUE(recording);
  auto stage = StereoStage::create(recording->rig(), {});
  ASSERT_TRUE(stage);
  Bytes file = rig_pair(*recording).file[0];
  const auto code = [&](const ImageView& left, const ImageView& right) {
    const auto done = stage->rectify({left, right});
    EXPECT_FALSE(done);
    return done ? ErrorCode::kConfiguration : done.error().code;
  };
  const ImageView good{PixelFormat::kJpeg, 1280, 720, file};
  const std::span<const std::uint8_t> cut(file.data(), file.size() / 2);
  EXPECT_EQ(code(good, {PixelFormat::kJpeg, 1280, 720, cut}), ErrorCode::kBadData);
  EXPECT_EQ(code({PixelFormat::kJpeg, 1280, 720, cut}, good), ErrorCode::kBadData);
  EXPECT_EQ(code({PixelFormat::kMono8, 1280, 720, cut}, good), ErrorCode::kWrongSize);
  EXPECT_EQ(code({PixelFormat::kJpeg, 720, 1280, file}, good), ErrorCode::kWrongSize);
  EXPECT_TRUE(stage->rectify({good, good}));
}

}  // namespace
}  // namespace crane
