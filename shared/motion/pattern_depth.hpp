// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "motion/cell_proof.hpp"

namespace crane {

/// Where the pair's match of a pattern may be wrong by whole periods: disparities that fit as well.
struct PatternRange {
  double least_px = 0, most_px = 0;  ///< disparities that are possible at all
  double fb = 0;                     ///< f_px * baseline_m
};

/// A pattern that repeats along the rows fits at several disparities, and the pair's choice among
/// them is chance. They are a handful: the image is alike itself where the next one fits. Each is
/// held against views from elsewhere (Okutomi and Kanade 1993): the one that all bear out is true
/// if two views at least contradict every other one. One thread each.
class PatternDepth {
 public:
  PatternDepth(const PlacedImage& image, const ViewSet& set, const PatternRange& range)
      : image_(image), set_(set), range_(range) {}

  /// The depth of the square of 32 x 32 px around (u, v), which the pair matched at
  /// `disparity_px` or at one that fits as well, and the views that bear it out.
  /// Nothing: several fit in all views, none does, or not enough is seen.
  std::optional<CellFit> choose(int u, int v, double disparity_px);

 private:
  struct Fit;
  static bool inside(const Grey& there, const Eigen::Vector2d& p);
  /// First pixel of the square in the small image of a view.
  [[nodiscard]] std::optional<Eigen::Vector2d> place(int x0, int y0, double disparity_px,
                                                     const MotionView& view) const;
  bool find_others(int x0, int y0, double disparity_px);
  [[nodiscard]] Fit fit(int x0, int y0, double disparity_px) const;
  [[nodiscard]] bool contradicts(int x0, int y0, double other_px, const Fit& best, std::size_t view,
                                 double limit) const;
  [[nodiscard]] std::uint32_t bearing(const Fit& fit) const;
  /// Moves the square by a pixel or so in the longest view.
  [[nodiscard]] double step_px() const;
  /// Up to this difference a view shows the same.
  [[nodiscard]] double borne_out() const;

  const PlacedImage& image_;
  const ViewSet& set_;
  PatternRange range_;
  std::vector<double> others_;  ///< [px], 0 among them
  std::vector<std::int32_t> offsets_;
  std::vector<std::uint16_t> costs_;
  double unlike_ = 0;  ///< mean difference of what does not fit
};

}  // namespace crane
