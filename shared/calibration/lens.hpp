// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace crane {

/// Which numbers of a lens are estimated; the others stay 0.
enum class LensFit {
  kRadialTangential,  ///< k1, k2, p1, p2
  kWithK3,            ///< and k3
  kRational,          ///< and k4, k5, k6
};

/// fx, fy, cx, cy [px], then k1, k2, p1, p2, k3, k4, k5, k6: OpenCV's order.
inline constexpr std::size_t kLensNumbers = 12;
using LensNumbers = std::array<double, kLensNumbers>;

/// So many of the numbers, from the first, are estimated.
constexpr std::size_t estimated(LensFit model) {
  return model == LensFit::kRadialTangential ? 8 : model == LensFit::kWithK3 ? 9 : 12;
}

/// Where a camera sees a point of its own frame (x right, y down, z forward). Number: double, or
/// what a solver differentiates by. Source: OpenCV's camera model, module calib3d.
template <class Number>
void project(const Number* lens, const Number* point, Number* pixel) {
  const Number x = point[0] / point[2];
  const Number y = point[1] / point[2];
  const Number r2 = x * x + y * y;
  const Number radial = (Number(1) + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))) /
                        (Number(1) + r2 * (lens[9] + r2 * (lens[10] + r2 * lens[11])));
  const Number& p1 = lens[6];
  const Number& p2 = lens[7];
  pixel[0] =
      lens[0] * (x * radial + Number(2) * p1 * x * y + p2 * (r2 + Number(2) * x * x)) + lens[2];
  pixel[1] =
      lens[1] * (y * radial + p1 * (r2 + Number(2) * y * y) + Number(2) * p2 * x * y) + lens[3];
}

}  // namespace crane
