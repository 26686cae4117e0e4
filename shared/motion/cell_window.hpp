// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// The window around a cell that is compared with other images [px]: rows x columns of it.
inline constexpr int kWindowEdge = 24, kWindowPixels = kWindowEdge * kWindowEdge;

/// The inner loops of CellProof, compiled for several instruction sets, chosen at run time. All
/// arrays hold kWindowPixels; brightness in grey levels.

/// `here` less another image between pixels: (fx, fy) right of and below its pixel `there`. Returns
/// the mean of that.
float window_difference(const float* here, const std::uint8_t* there, std::ptrdiff_t stride,
                        float fx, float fy, float* difference);

/// A window of the newest image, and what another one differs from it.
struct WindowDifference {
  const float* gx;  ///< gradients of the newest image
  const float* gy;
  const float* difference;
  float mean;   ///< of the difference
  float noise;  ///< variance of a difference that noise makes
};

/// Sums of least squares for a shift along (mx, my): what is hidden, or another surface, loses its
/// weight.
struct WindowSums {
  float gg = 0, gr = 0;
};
WindowSums window_sums(const WindowDifference& in, float mx, float my);

/// Mean of the squared differences in what noise, and a slip of so many pixels, give.
float window_misfit(const WindowDifference& in, float slip_px);

}  // namespace crane
