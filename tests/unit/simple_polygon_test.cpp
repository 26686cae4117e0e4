// SPDX-License-Identifier: Apache-2.0
#include "geometry/simple_polygon.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace crane {
namespace {

using Corners = std::vector<Corner>;

/// The same outline begun at another corner, and the other way round.
void expect_in_every_order(Corners corners, const std::string& says) {
  for (int way = 0; way < 2; ++way) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::string flaw = polygon_flaw(corners);
      if (says.empty())
        EXPECT_EQ(flaw, "");
      else
        EXPECT_NE(flaw.find(says), std::string::npos) << "'" << flaw << "'";
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
    std::reverse(corners.begin(), corners.end());
  }
}

TEST(PolygonFlaw, FindsNoneInConvexAndConcaveOutlines) {
  expect_in_every_order({{0, 0}, {4, 0}, {4, 3}}, "");
  expect_in_every_order({{1.6, 0.8}, {2.0, 0.8}, {2.0, 1.2}, {1.6, 1.2}}, "");
  expect_in_every_order({{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}}, "");  // arrow
  expect_in_every_order({{0, 0}, {6, 0}, {6, 4}, {4, 4}, {4, 2}, {2, 2}, {2, 4}, {0, 4}}, "");  // U
  expect_in_every_order({{0, 0}, {2, 0}, {4, 0}, {4, 3}, {0, 3}}, "");  // a corner on an edge
  expect_in_every_order({{80'000, 0}, {80'000.5, 0}, {80'000.5, 0.5}, {80'000, 0.5}}, "");
}

TEST(PolygonFlaw, NamesEdgesThatCrossOrTouch) {
  expect_in_every_order({{1.6, 0.8}, {2.0, 1.2}, {2.0, 0.8}, {1.6, 1.2}}, "cross");
  expect_in_every_order({{0, 0}, {2, 3}, {4, 0}, {0, 2}, {4, 2}}, "cross");  // star
  expect_in_every_order({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}, "cross");  // touches
  expect_in_every_order({{0, 0}, {4, 0}, {4, 2}, {1, 2}, {1, 0}, {3, 0}, {3, 4}, {0, 4}}, "cross");
}

TEST(PolygonFlaw, NamesWhatEnclosesNothing) {
  EXPECT_NE(polygon_flaw({}), "");
  EXPECT_NE(polygon_flaw({{0, 0}, {1, 1}}), "");
  expect_in_every_order({{0, 0}, {1, 1}, {2, 2}}, "no area");
}

TEST(PolygonFlaw, NamesSpikesDoubledCornersAndWhatIsNotFinite) {
  expect_in_every_order({{0, 0}, {4, 0}, {4, 3}, {4, 6}, {4, 3.5}, {0, 3}}, "turns back");
  expect_in_every_order({{0, 0}, {4, 0}, {4, 3}, {0, 3}, {0, 0}}, "same place");  // a closed ring
  expect_in_every_order({{0, 0}, {0.005, 0}, {0.005, 0.005}}, "1 cm2");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  expect_in_every_order({{0, 0}, {nan, 0}, {4, 3}}, "not finite");
  expect_in_every_order({{0, 0}, {4, 0}, {4, inf}}, "not finite");
}

/// Any order of the corners of a convex outline but the one around it crosses somewhere.
TEST(PolygonFlaw, TakesOfAllOrdersOnlyThoseAroundTheOutline) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    Corners around;
    const int n = 4 + static_cast<int>(random() % 3);
    for (int i = 0; i < n; ++i) {
      const double angle = 6.283 * (i + 0.7 * double(random() % 100) / 100) / n;
      around.push_back({10 + 3 * std::cos(angle), -5 + 2 * std::sin(angle)});
    }
    std::vector<int> order(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) order[static_cast<std::size_t>(i)] = i;
    do {
      Corners corners;
      bool neighbours = true;
      for (int i = 0; i < n; ++i) {
        corners.push_back(around[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])]);
        const int step = std::abs(order[static_cast<std::size_t>(i)] -
                                  order[static_cast<std::size_t>((i + 1) % n)]);
        neighbours = neighbours && (step == 1 || step == n - 1);
      }
      ASSERT_EQ(polygon_flaw(corners).empty(), neighbours);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

}  // namespace
}  // namespace crane
