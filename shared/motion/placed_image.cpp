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
