// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/placement_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace crane {
namespace {

using Verdict = PlacementCheck::Verdict;
constexpr TimeNs kT0 = 1000 * kNsPerSecond;

/// A number in 0 .. 1 for each place, without any pattern.
double random_at(int x, int y) {
  auto h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL + static_cast<std::uint64_t>(y);
  h = (h ^ h >> 30U) * 0xBF58476D1CE4E5B9ULL;
  h = (h ^ h >> 27U) * 0x94D049BB133111EBULL;
  return double(h >> 40U) / double(1U << 24U);
}

struct World {
  std::function<double(double, double)> height_m = [](double, double) { return 0.0; };
  std::function<double(double, double)> grey = [](double x, double y) {
    return 100 + 60 * random_at(int(std::floor(x / 0.2)), int(std::floor(y / 0.2)));
  };
};

/// What a camera 9 m high sees of a world, level things only.
class Shot {
 public:
  Shot(const World& world, double true_x, double true_y, double said_x, double said_y,
       bool colour = true) {
    depth_.resize(kWidth * kHeight);
    confidence_.assign(kWidth * kHeight, 255);
    colour_.resize(3 * kWidth * kHeight);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const double kx = (u - 319.5) / kF;
        const double ky = -(v - 179.5) / kF;
        double z = 9;  // twice: where the ray meets a height depends on the height
        for (int i = 0; i < 2; ++i) z = 9 - world.height_m(true_x + kx * z, true_y + ky * z);
        const auto i = std::size_t(v * kWidth + u);
        depth_[i] = float(z);
        const double g = world.grey(true_x + kx * z, true_y + ky * z);
        for (std::size_t c = 0; c < 3; ++c) colour_[3 * i + c] = std::uint8_t(std::min(255., g));
      }
    frame.width = kWidth;
    frame.height = kHeight;
    frame.f_px = kF;
    frame.cx_px = 319.5;
    frame.cy_px = 179.5;
    frame.baseline_m = 0.5;
    frame.sigma_disparity_px = 0.05;
    frame.depth_m = depth_.data();
    frame.confidence = confidence_.data();
    if (colour) frame.colour = colour_.data();
    frame.T_map_rectified.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    frame.T_map_rectified.translation() = Eigen::Vector3d(said_x, said_y, 9);
  }
  DepthFrame frame;

 private:
  static constexpr int kWidth = 640, kHeight = 360;
  static constexpr double kF = 450;
  std::vector<float> depth_;
  std::vector<std::uint8_t> confidence_, colour_;
};

class PlacementCheckTest : public ::testing::Test {
 protected:
  PlacementCheck check_{0.13};
  World world_;

  Verdict look(const Shot& shot, TimeNs after_s = 1) {
    return check_.compare(shot.frame, kT0 + after_s * kNsPerSecond, true).verdict;
  }
  void remember(const Shot& shot) {
    (void)check_.compare(shot.frame, kT0, true);
    check_.remember();
  }
};

TEST_F(PlacementCheckTest, AFrameWhereItIsAgreesAndElsewhereContradicts) {
  remember(Shot(world_, 10, 5, 10, 5));
  EXPECT_EQ(look(Shot(world_, 11, 5, 11, 5)), Verdict::kAgrees);
  EXPECT_EQ(look(Shot(world_, 10, 6, 10, 6)), Verdict::kAgrees);
  for (const double off_m : {-3.0, -0.6, 0.4, 1.5, 4.0})
    for (const bool along : {true, false}) {
      const Shot shot(world_, 10.5, 5.2, 10.5 + (along ? off_m : 0), 5.2 + (along ? 0 : off_m));
      const auto found = check_.compare(shot.frame, kT0 + kNsPerSecond, true);
      if (!along && std::abs(off_m) > 2) continue;  // too little of it was seen before
      EXPECT_EQ(found.verdict, Verdict::kContradicts) << off_m << along;
      EXPECT_NEAR(found.shift_m[along ? 0 : 1], -off_m, 0.14) << off_m << along;
    }
}

TEST_F(PlacementCheckTest, LampsThatSwitchChangeNothing) {
  remember(Shot(world_, 10, 5, 10, 5));
  World dim = world_;
  dim.grey = [this](double x, double y) { return (0.3 + 0.04 * x) * world_.grey(x, y); };
  EXPECT_EQ(look(Shot(dim, 10.5, 5, 10.5, 5)), Verdict::kAgrees);
  EXPECT_EQ(look(Shot(dim, 10.5, 5, 11.3, 5)), Verdict::kContradicts);
}

TEST_F(PlacementCheckTest, WhatMovesInTheWorkshopContradictsNothing) {
  const auto with_box = [this](double bx, double by) {
    World w = world_;
    const auto inside = [bx, by](double x, double y) {
      return std::abs(x - bx) < 1 && std::abs(y - by) < 1;
    };
    w.height_m = [inside](double x, double y) { return inside(x, y) ? 1.2 : 0.0; };
    w.grey = [inside, this](double x, double y) { return inside(x, y) ? 40. : world_.grey(x, y); };
    return w;
  };
  remember(Shot(with_box(9, 5), 10, 5, 10, 5));
  EXPECT_EQ(look(Shot(with_box(12, 4), 10.5, 5, 10.5, 5)), Verdict::kAgrees);
  EXPECT_EQ(look(Shot(with_box(1000, 0), 10.5, 5, 10.5, 5)), Verdict::kAgrees);
}

TEST_F(PlacementCheckTest, ALoadThatHangsInThePictureContradictsNothing) {
  const auto with_load = [this](double cart) {
    World w = world_;
    w.height_m = [cart](double x, double y) {
      return std::abs(x - cart) < 1.2 && std::abs(y - 5) < 1.2 ? 2.0 : 0.0;
    };
    w.grey = [cart, this](double x, double y) {
      return std::abs(x - cart) < 1.2 && std::abs(y - 5) < 1.2
                 ? 60 + 100 * random_at(int(std::floor((x - cart) / 0.2)), int(std::floor(y / 0.2)))
                 : world_.grey(x, y);
    };
    return w;
  };
  remember(Shot(with_load(10), 10, 5, 10, 5));
  EXPECT_NE(look(Shot(with_load(11), 11, 5, 11, 5)), Verdict::kContradicts);
}

TEST_F(PlacementCheckTest, WhereAllLooksTheSameItDoesNotDecide) {
  World plain;
  plain.grey = [](double, double) { return 120; };
  remember(Shot(plain, 10, 5, 10, 5));
  EXPECT_EQ(look(Shot(plain, 10.5, 5, 11.5, 5)), Verdict::kUndecided);
  EXPECT_EQ(look(Shot(plain, 10.5, 5, 10.5, 5)), Verdict::kUndecided);
}

TEST_F(PlacementCheckTest, WhatWasNotSeenLatelyDoesNotCount) {
  remember(Shot(world_, 10, 5, 10, 5));
  EXPECT_EQ(look(Shot(world_, 60, 5, 60, 5)), Verdict::kUndecided) << "never been there";
  World other;
  other.grey = [](double x, double y) {
    return 100 + 60 * random_at(7 + int(std::floor(x / 0.2)), 1000 + int(std::floor(y / 0.2)));
  };
  EXPECT_EQ(look(Shot(other, 10, 5, 10, 5), 60), Verdict::kUndecided) << "a minute later";
}

TEST_F(PlacementCheckTest, WithoutColourHeightsDecide) {
  World boxes = world_;
  boxes.height_m = [](double x, double y) {
    return random_at(int(std::floor(x / 1.3)), int(std::floor(y / 1.3))) > 0.7 ? 1.0 : 0.0;
  };
  remember(Shot(boxes, 10, 5, 10, 5, false));
  EXPECT_EQ(look(Shot(boxes, 10.4, 5, 10.4, 5, false)), Verdict::kAgrees);
  EXPECT_EQ(look(Shot(boxes, 10.4, 5, 11.5, 5, false)), Verdict::kContradicts);
}

TEST_F(PlacementCheckTest, PositionsThatDriftAwayFrameByFrameAreFoundOut) {
  remember(Shot(world_, 10, 5, 10, 5));
  bool contradicted = false;
  for (int i = 1; i <= 10 && !contradicted; ++i) {
    const double moved = 0.06 * i;
    const Shot shot(world_, 10 + moved, 5, 10 - moved, 5);
    const auto found = check_.compare(shot.frame, kT0 + i * kNsPerSecond / 10, false);
    contradicted = found.verdict == Verdict::kContradicts;
    if (!contradicted) check_.remember();
  }
  EXPECT_TRUE(contradicted);
}

}  // namespace
}  // namespace crane
