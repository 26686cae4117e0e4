// SPDX-License-Identifier: Apache-2.0
#include "stereo/disparity_support.hpp"

#include <algorithm>
#include <vector>

#include "base/expects.hpp"
#include "stereo/semi_global.hpp"

namespace crane {
namespace {
constexpr int kReach = 4;
constexpr int kStep = 2;
constexpr std::uint16_t kOnePixel = kDisparityScale;
constexpr int kNeighbours = 24;
}  // namespace

void disparity_support(std::span<const std::int16_t> disparity, std::size_t width,
                       std::size_t height, std::int16_t first_valid,
                       std::span<std::uint8_t> confidence) {
  expects(disparity.size() == width * height && confidence.size() == width * height,
          "disparity and confidence fit the size");
  std::fill(confidence.begin(), confidence.end(), std::uint8_t{0});
  if (width <= 2 * kReach) return;
  std::vector<std::uint16_t> votes(width);
  for (std::size_t y = 0; y < height; ++y) {
    const std::int16_t* centre = disparity.data() + y * width;
    std::fill(votes.begin(), votes.end(), std::uint16_t{0});
    for (int dy = -kReach; dy <= kReach; dy += kStep) {
      const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) + dy;
      if (row < 0 || row >= static_cast<std::ptrdiff_t>(height)) continue;
      const std::int16_t* other = disparity.data() + row * static_cast<std::ptrdiff_t>(width);
      for (int dx = -kReach; dx <= kReach; dx += kStep) {
        if (dx == 0 && dy == 0) continue;
        for (std::size_t x = kReach; x < width - kReach; ++x) {
          // |difference| <= one pixel, in one unsigned 16-bit comparison: eight pixels at a time.
          const auto shifted = static_cast<std::uint16_t>(
              centre[x] - other[static_cast<std::ptrdiff_t>(x) + dx] + kOnePixel);
          votes[x] = static_cast<std::uint16_t>(votes[x] + (shifted <= 2 * kOnePixel));
        }
      }
    }
    std::uint8_t* out = confidence.data() + y * width;
    for (std::size_t x = kReach; x < width - kReach; ++x)
      out[x] = centre[x] >= first_valid
                   ? static_cast<std::uint8_t>(std::max(1, votes[x] * 255 / kNeighbours))
                   : std::uint8_t{0};
  }
}

}  // namespace crane
