// SPDX-License-Identifier: Apache-2.0
#include "motion/bars.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "motion/bar_bands.hpp"

namespace crane {
namespace {

constexpr int kWidth = 480, kHeight = 240;
constexpr double kFocal = 500, kCamera_m = 9, kBar_m = 1.5;

/// Without a period anywhere: waves of many directions.
double texture(double x, double y) {
  double sum = 0;
  for (int i = 1; i <= 14; ++i) {
    const double angle = 2.399963 * i, k = 4 + 1.37 * i;
    sum += std::sin(k * (std::cos(angle) * x + std::sin(angle) * y) + 1.7 * i * i);
  }
  return 120 + 9 * sum;
}

/// A plain light strip along x; `painted`: on the floor.
struct Strip {
  double y = 0.5, from = -1.5, to = 1.5, width = 0.09;
  bool painted = false;
  [[nodiscard]] bool at(double px, double py) const {
    return px > from && px < to && py > y && py < y + width;
  }
};

/// A floor 9 m below with strips, from (x, y); the pair matches all but what is within three rows
/// of a strip.
struct Scene {
  std::vector<std::uint8_t> bgr = std::vector<std::uint8_t>(3 * kWidth * kHeight);
  std::vector<float> depth = std::vector<float>(kWidth * kHeight, float(kCamera_m));
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kWidth * kHeight, 255);
  std::vector<std::uint8_t> truth = std::vector<std::uint8_t>(kWidth * kHeight);
  DepthFrame frame;
  PlacedImage image;

  Scene(double x, double y, const std::vector<Strip>& strips, TimeNs at) {
    std::mt19937 random(static_cast<unsigned>(at / 1'000'000));
    std::normal_distribution<double> noise(0, 1.5);
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column) {
        const double rx = (column - 239.5) / kFocal, ry = -(row - 119.5) / kFocal;
        double grey = texture(x + rx * kCamera_m, y + ry * kCamera_m);
        bool near = false;
        const std::size_t i = std::size_t(row * kWidth + column);
        for (const Strip& s : strips) {
          const double z = s.painted ? kCamera_m : kCamera_m - kBar_m;
          constexpr int kAround = 3;
          for (int r = -kAround; r <= kAround; ++r)
            near |= s.at(x + rx * z, y - (row + r - 119.5) / kFocal * z);
          if (!s.at(x + rx * z, y + ry * z)) continue;
          grey = 210;
          truth[i] = 1;
        }
        if (near) depth[i] = 0;
        for (std::size_t c = 0; c < 3; ++c)
          bgr[3 * i + c] = std::uint8_t(std::clamp(grey + noise(random), 0.0, 255.0));
      }
    frame.width = kWidth;
    frame.height = kHeight;
    frame.f_px = kFocal;
    frame.cx_px = 239.5;
    frame.cy_px = 119.5;
    frame.baseline_m = 0.5;
    frame.sigma_disparity_px = 0.05;
    frame.T_map_rectified.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    frame.T_map_rectified.translation() = Eigen::Vector3d(x, y, kCamera_m);
    frame.depth_m = depth.data();
    frame.confidence = confidence.data();
    frame.colour = bgr.data();
    image = placed_image(frame, at);
  }
};

struct Stop {
  double x, y, t_s;
};
/// From beside, and not at one speed.
const std::vector<Stop> kFromBeside = {{0.8, -0.3, 0}, {0, -0.4, 1}, {-0.8, -0.2, 2}};

struct Looked {
  BarReport report;
  std::size_t on_bar = 0, found = 0, beside = 0;
  double worst_m = 0;
  std::vector<float> depth;
};

Looked look(const std::vector<Strip>& strips, const std::vector<Stop>& stops, int threads = 1,
            std::size_t most = 1000, const std::vector<Strip>* now = nullptr) {
  Scene newest(0, 0.5, now != nullptr ? *now : strips, 3'000'000'000);
  ViewSet set;
  set.noise_grey = 1.5;
  for (const Stop& s : stops) {
    MotionView v;
    const Scene scene(s.x, s.y, strips, TimeNs(s.t_s * 1e9));
    v.image = std::make_shared<PlacedImage>(scene.image);
    v.displacement_m = Eigen::Vector2d(-s.x, 0.5 - s.y);
    v.sigma_m = 0.003;
    v.warp = warp_between(newest.image.T_map_rectified, scene.image.T_map_rectified);
    set.longest_m = std::max(set.longest_m, v.displacement_m.norm());
    set.views.push_back(std::move(v));
  }
  set.proves_rest = true;
  Looked out;
  Bars bars(threads);
  const auto before = newest.depth;
  out.report = bars.look(newest.frame, newest.image, set, newest.depth, newest.confidence, most);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const auto i = std::size_t(row * kWidth + column);
      if (newest.truth[i] != 0) ++out.on_bar;
      if (newest.depth[i] == before[i]) continue;
      EXPECT_LT(newest.depth[i], 0) << "likely: it frees nothing";
      out.worst_m = std::max(out.worst_m, std::abs(-double(newest.depth[i]) - kCamera_m + kBar_m));
      bool near = false;
      for (int r = std::max(0, row - 3); r <= std::min(kHeight - 1, row + 3); ++r)
        near |= newest.truth[std::size_t(r * kWidth + column)] != 0;
      (newest.truth[i] != 0 ? out.found : out.beside) += 1;
      if (!near) out.beside += 1000;
    }
  out.depth = newest.depth;
  return out;
}

TEST(Bars, AlongTheBaselineAreFoundFromBeside) {
  const auto out = look({{}}, kFromBeside);
  ASSERT_GT(out.on_bar, 800U);
  EXPECT_GT(double(out.found), 0.9 * double(out.on_bar));
  EXPECT_LT(double(out.beside), 0.4 * double(out.on_bar)) << "a row or two";
  EXPECT_LT(out.worst_m, 0.13) << "a pixel across the rows";
}

TEST(Bars, ThatAreOnlyPaintedAreNone) {
  Strip painted;
  painted.painted = true;
  const auto out = look({painted}, kFromBeside);
  EXPECT_GT(out.report.bands, 5U);
  EXPECT_EQ(out.report.found, 0U);
}

TEST(Bars, AreNotToldFromWhereTheyLookAlike) {
  // Along the rows, too few from beside, or as steadily as a bar might move by itself.
  EXPECT_EQ(look({{}}, {{0.8, 0.5, 0}, {-0.4, 0.5, 1}, {-0.8, 0.5, 2}}).report.found, 0U);
  EXPECT_EQ(look({{}}, {{0.8, -0.3, 0}, {-0.8, -0.2, 2}}).report.found, 0U);
  EXPECT_EQ(look({{}}, {{0.6, -0.4, 0}, {0.4, -0.1, 1}, {0.2, 0.2, 2}}).report.found, 0U);
}

TEST(Bars, ThatCouldBeOneAnotherAtAnotherDepthStayUnknown) {
  // In every earlier image the lower one lies where the upper one would, were it at 5 m.
  Strip lower, upper;
  const double z = kCamera_m - kBar_m, away = 0.7;
  lower.y = 0.2, upper.y = lower.y + away * z * (1 / 5.0 - 1 / z);
  const auto out = look({lower, upper}, {{0.8, -0.2, 0}, {0, -0.2, 1}, {-0.8, -0.2, 2}});
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column)
      if (const float d = out.depth[std::size_t(row * kWidth + column)]; d < 0)
        ASSERT_GT(-d, 7.3F) << "row " << row << ": a bar where there is none";
}

TEST(Bars, ThatMovedAreNotWhereTheyWouldFit) {
  Strip moved;
  moved.y += 0.25;
  const std::vector<Strip> now = {moved};
  const auto out = look({{}}, {{0.8, -0.3, 0}, {0, -0.4, 1}, {-0.8, 1.3, 2}}, 1, 1000, &now);
  EXPECT_EQ(out.report.found, 0U);
}

TEST(Bars, AreTheSameOnAnyNumberOfThreads) {
  const auto one = look({{}}, kFromBeside, 1), three = look({{}}, kFromBeside, 3);
  EXPECT_EQ(one.depth, three.depth);
}

TEST(Bars, AreBoundedAndThoseLeftOutHaveTheirTurn) {
  const auto out = look({{}}, kFromBeside, 1, 4);
  EXPECT_LE(out.report.bands, 5U);
  EXPECT_GT(out.report.put_off, 5U);
}

/// Bands of a column of pieces whose rows have these depths.
std::vector<BarBand> bands_of(const std::vector<float>& rows) {
  std::vector<float> depth;
  for (const float z : rows) depth.insert(depth.end(), kBarPiece, z);
  DepthFrame f;
  f.width = kBarPiece;
  f.height = static_cast<std::uint32_t>(rows.size());
  return bar_bands(f, depth.data(), 0);
}

TEST(BarBands, LieBetweenWhatIsMatched) {
  const auto bands = bands_of({9, 9, 0, 0, 0, 9.05F, 9});
  ASSERT_EQ(bands.size(), 1U);
  EXPECT_EQ(bands[0].v0, 2);
  EXPECT_EQ(bands[0].v1, 5);
  EXPECT_FLOAT_EQ(bands[0].background_m, 9);
  const float not_seen = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(bands_of({9, not_seen, 0, not_seen, 9}).size(), 1U);
  EXPECT_EQ(bands_of({-9, 0, 0, -9}).size(), 1U) << "likely ones are matches";
}

TEST(BarBands, HoldTheirBarsOwnMatches) {
  const auto bands = bands_of({9, 0, 0, 7.5F, 0, 0, 9});
  ASSERT_EQ(bands.size(), 1U);
  EXPECT_EQ(bands[0].v0, 1);
  EXPECT_EQ(bands[0].v1, 6);
}

TEST(BarBands, AreNeitherEdgesOfBoxesNorWholeFloorsNorTheBorder) {
  EXPECT_TRUE(bands_of({9, 9, 0, 9, 9}).empty()) << "one row";
  EXPECT_TRUE(bands_of({0, 0, 0, 9, 9}).empty());
  EXPECT_TRUE(bands_of({9, 9, 0, 0, 0}).empty());
  std::vector<float> box(60, 7.5F);
  for (int v = 0; v < 10; ++v) box[std::size_t(v)] = 9;
  for (int v = 10; v < 14; ++v) box[std::size_t(v)] = 0;
  EXPECT_TRUE(bands_of(box).empty()) << "never ends";
  std::vector<float> floor(60, 0);
  floor.front() = floor.back() = 9;
  EXPECT_TRUE(bands_of(floor).empty());
  EXPECT_TRUE(bands_of({}).empty());
}

}  // namespace
}  // namespace crane
