// SPDX-License-Identifier: Apache-2.0
#include "motion/placed_image.hpp"

#include "base/expects.hpp"
#include "base/threads.hpp"

namespace crane {
namespace {

/// ITU-R BT.601, in 1/256.
constexpr int kBlue = 29, kGreen = 150, kRed = 77;

/// Rows [from, to).
void make_grey(const std::uint8_t* bgr, Grey& out, int from, int to) {
  const std::size_t width = std::size_t(out.width);
  for (std::size_t i = std::size_t(from) * width; i < std::size_t(to) * width; ++i) {
    const std::uint8_t* p = bgr + 3 * i;
    out.pixels[i] =
        static_cast<std::uint8_t>((kBlue * p[0] + kGreen * p[1] + kRed * p[2] + 128) / 256);
  }
}

void halve(const Grey& full, Grey& half, int from, int to) {
  for (int y = from; y < to; ++y) {
    const std::uint8_t* a = full.row(2 * y);
    const std::uint8_t* b = full.row(2 * y + 1);
    std::uint8_t* at = half.pixels.data() + std::size_t(y) * std::size_t(half.width);
    for (int x = 0; x < half.width; ++x)
      at[x] =
          static_cast<std::uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) / 4);
  }
}

/// Sliding sums along columns, then along the row.
void take_mean_away(const Grey& image, Grey& out, int from, int to) {
  constexpr int kReach = 16, kAcross = 2 * kReach + 1, kCount = kAcross * kAcross;
  if (image.width <= kAcross || image.height <= kAcross) return;
  const auto clamped = [](int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; };
  std::vector<int> columns(std::size_t(image.width) + 2 * kReach + 1);
  std::vector<int> sums(std::size_t(image.width));
  for (int y = from - kReach; y <= from + kReach; ++y) {
    const std::uint8_t* row = image.row(clamped(y, image.height));
    for (int x = 0; x < image.width; ++x) sums[std::size_t(x)] += row[x];
  }
  for (int y = from; y < to; ++y) {
    for (int x = -kReach; x <= image.width + kReach; ++x)
      columns[std::size_t(x + kReach)] = sums[std::size_t(clamped(x, image.width))];
    int sum = 0;
    for (int i = 0; i < kAcross; ++i) sum += columns[std::size_t(i)];
    std::uint8_t* at = out.pixels.data() + std::size_t(y) * std::size_t(image.width);
    const std::uint8_t* own = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      const int v = own[x] - sum / kCount + 128;
      at[x] = static_cast<std::uint8_t>(v < 0 ? 0 : v > 255 ? 255 : v);
      sum += columns[std::size_t(x + kAcross)] - columns[std::size_t(x)];
    }
    const std::uint8_t* leaves = image.row(clamped(y - kReach, image.height));
    const std::uint8_t* comes = image.row(clamped(y + kReach + 1, image.height));
    for (int x = 0; x < image.width; ++x) sums[std::size_t(x)] += comes[x] - leaves[x];
  }
}

}  // namespace

PlacedImage placed_image(const DepthFrame& f, TimeNs exposure, int threads) {
  expects(f.colour != nullptr, "the frame has colour");
  PlacedImage out;
  const auto width = static_cast<int>(f.width), height = static_cast<int>(f.height);
  out.full = {width, height, {}};
  out.half = out.contrast = {width / 2, height / 2, {}};
  out.full.pixels.resize(std::size_t(width) * std::size_t(height));
  out.half.pixels.resize(std::size_t(width / 2) * std::size_t(height / 2));
  out.contrast.pixels.assign(out.half.pixels.size(), 128);
  on_threads(threads, [&](int thread, Meeting& meeting) {
    const Share rows = share_of(height / 2, thread, threads);
    make_grey(f.colour, out.full, 2 * rows.begin, thread + 1 < threads ? 2 * rows.end : height);
    halve(out.full, out.half, rows.begin, rows.end);
    meeting.meet();  // all of the half
    take_mean_away(out.half, out.contrast, rows.begin, rows.end);
  });
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
