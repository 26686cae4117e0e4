// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "motion/bar_bands.hpp"
#include "motion/views.hpp"

namespace crane {

/// What lies before the background in a piece of a band.
struct BarFit {
  double inverse_m = 0, sigma = 0;  ///< [1/m]
  int v0 = 0, v1 = 0;               ///< its rows, v0 <= v < v1
  float background_m = 0;           ///< depth of what lies around it
  double step = 0;                  ///< [1/m] that moves it by a pixel in the farthest view
};

/// Compares strips of kWidth x kHeight px with the views that see them from beside. One thread
/// each.
class BarSweep {
 public:
  /// `nearest_m`: depth of the nearest that is looked for.
  BarSweep(const PlacedImage& image, const ViewSet& set, double nearest_m);

  /// Enough views from beside, and what moves steadily across the rows would not fit them all.
  [[nodiscard]] bool can_tell() const { return can_tell_; }
  /// Nothing: the background does as well, or other depths do.
  std::optional<BarFit> look(const BarBand& band);
  /// The piece at `u0`, beside a bar: the bar goes on there if its depth, or nearly that, explains
  /// its rows better than the background.
  std::optional<BarFit> follow(const BarFit& bar, int u0);

 private:
  static constexpr int kWidth = 32, kHalf = 1, kHeight = 2 * kHalf + 1;
  static constexpr int kMostRows = 48, kMostSteps = 256;
  struct View {
    const MotionView* view;
    float offset = 0;  ///< its brightness less the newest one's, beside the band
    bool sees = false;
  };
  struct Point {
    double x, y;
  };
  /// Where the piece's first column and row `v` fall in a view.
  [[nodiscard]] std::optional<Point> place(const MotionView& view, int u, int v,
                                           double inverse_m) const;
  bool take_offsets(int v0, int v1);
  void measure();
  /// Mean absolute difference of rows v - half to v + half between pixels, over the views that see
  /// them; `views` counts these.
  double cost(int v, int half, double inverse_m, int* views = nullptr) const;
  /// The least of that within so many steps around a depth, and where.
  [[nodiscard]] std::pair<double, double> closest(int v, int half, double inverse_m,
                                                  double steps = 1) const;
  /// The rows that the bar's depth explains better than the background; false: too few.
  bool take_rows(const BarBand& band, BarFit& bar) const;

  const PlacedImage& image_;
  std::vector<View> views_;
  double longest_m_ = 0, position_ = 0, nearest_inverse_;
  bool can_tell_ = false;
  // Of the band that is looked at.
  int u_ = 0, width_ = kWidth, first_ = 0, rows_ = 0, steps_ = 0;
  double background_ = 0, step_ = 0;
  std::vector<float> sum_;          ///< steps x rows: differences of a row, over the views
  std::vector<std::uint8_t> seen_;  ///< views, a step
};

}  // namespace crane
