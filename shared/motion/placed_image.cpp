// SPDX-License-Identifier: Apache-2.0
#include "motion/placed_image.hpp"

#include "base/expects.hpp"

namespace crane {
namespace {

/// ITU-R BT.601, in 1/256.
constexpr int kBlue = 29, kGreen = 150, kRed = 77;

Grey halved(const Grey& full) {
  Grey half{full.width / 2, full.height / 2, {}};
  half.pixels.resize(std::size_t(half.width) * std::size_t(half.height));
  for (int y = 0; y < half.height; ++y) {
    const std::uint8_t* a = full.row(2 * y);
    const std::uint8_t* b = full.row(2 * y + 1);
    std::uint8_t* to = half.pixels.data() + std::size_t(y) * std::size_t(half.width);
    for (int x = 0; x < half.width; ++x)
      to[x] =
          static_cast<std::uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) / 4);
  }
  return half;
}

/// Sliding sums along columns, then along the row.
Grey without_mean(const Grey& image) {
  constexpr int kReach = 16, kAcross = 2 * kReach + 1, kCount = kAcross * kAcross;
  Grey out{image.width, image.height, {}};
  out.pixels.assign(image.pixels.size(), 128);
  if (image.width <= kAcross || image.height <= kAcross) return out;
  const auto clamped = [](int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; };
  std::vector<int> columns(std::size_t(image.width) + 2 * kReach + 1);
  std::vector<int> sums(std::size_t(image.width));
  for (int y = -kReach; y <= kReach; ++y)
    for (int x = 0; x < image.width; ++x)
      sums[std::size_t(x)] += image.row(clamped(y, image.height))[x];
  for (int y = 0; y < image.height; ++y) {
    for (int x = -kReach; x <= image.width + kReach; ++x)
      columns[std::size_t(x + kReach)] = sums[std::size_t(clamped(x, image.width))];
    int sum = 0;
    for (int i = 0; i < kAcross; ++i) sum += columns[std::size_t(i)];
    std::uint8_t* to = out.pixels.data() + std::size_t(y) * std::size_t(image.width);
    const std::uint8_t* from = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      const int v = from[x] - sum / kCount + 128;
      to[x] = static_cast<std::uint8_t>(v < 0 ? 0 : v > 255 ? 255 : v);
      sum += columns[std::size_t(x + kAcross)] - columns[std::size_t(x)];
    }
    const std::uint8_t* leaves = image.row(clamped(y - kReach, image.height));
    const std::uint8_t* comes = image.row(clamped(y + kReach + 1, image.height));
    for (int x = 0; x < image.width; ++x) sums[std::size_t(x)] += comes[x] - leaves[x];
  }
  return out;
}

}  // namespace

PlacedImage placed_image(const DepthFrame& f, TimeNs exposure) {
  expects(f.colour != nullptr, "the frame has colour");
  PlacedImage out;
  out.full = {static_cast<int>(f.width), static_cast<int>(f.height), {}};
  out.full.pixels.resize(std::size_t(f.width) * f.height);
  const std::uint8_t* bgr = f.colour;
  for (std::uint8_t& grey : out.full.pixels) {
    grey =
        static_cast<std::uint8_t>((kBlue * bgr[0] + kGreen * bgr[1] + kRed * bgr[2] + 128) / 256);
    bgr += 3;
  }
  out.half = halved(out.full);
  out.contrast = without_mean(out.half);
  out.f_px = f.f_px;
  out.cx_px = f.cx_px;
  out.cy_px = f.cy_px;
  out.T_map_rectified = f.T_map_rectified;
  out.exposure = exposure;
  return out;
}

Warp warp_between(const Eigen::Isometry3d& T_map_from, const Eigen::Isometry3d& T_map_to,
                  const Eigen::Vector2d& moved_m) {
  Eigen::Isometry3d moved = T_map_from;
  moved.translation().head<2>() += moved_m;
  const Eigen::Isometry3d T_to_from = T_map_to.inverse() * moved;
  return {T_to_from.linear(), T_to_from.translation()};
}

}  // namespace crane
