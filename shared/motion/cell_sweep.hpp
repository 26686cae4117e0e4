// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "motion/views.hpp"

namespace crane {

/// Inverse depths [1/m] that are tried: first + i * step.
struct Hypotheses {
  double first = 0, step = 0;
  int count = 0;
  [[nodiscard]] double at(double i) const { return first + i * step; }
};
/// From `nearest_m` to `farthest_m`, so that the longest displacement moves by two pixels a step.
Hypotheses hypotheses_for(const PlacedImage& image, const ViewSet& set, double nearest_m,
                          double farthest_m);

/// One depth of a square of 32 x 32 pixels, to half a step.
struct CellCandidate {
  double inverse_m = 0;       ///< [1/m]
  float cost = 0;             ///< mean absolute difference over the views that see it
  std::uint32_t visible = 0;  ///< bits of these views
  std::uint32_t bearing = 0;  ///< bits of those that bear it out and tell depths apart
};

/// Plane sweep (Collins 1996) over all views at once (Okutomi and Kanade 1993: the sum over
/// baselines has one minimum where each alone has many). One thread each.
class CellSweep {
 public:
  CellSweep(const PlacedImage& image, const ViewSet& set, const Hypotheses& hypotheses);

  /// Around the middle (u, v) [px]: the best depth first, then all that could be as good if they
  /// were looked at closer. Empty: nothing fits, or too much does.
  const std::vector<CellCandidate>& look(int u, int v);

 private:
  bool measure(int x0, int y0);
  /// What half a pixel beside would cost.
  [[nodiscard]] float slip_at(int x0, int y0) const;
  [[nodiscard]] CellCandidate candidate(std::size_t i) const;

  const PlacedImage& image_;
  const ViewSet& set_;
  Hypotheses hypotheses_;
  std::vector<std::int32_t> offsets_;
  std::vector<std::uint16_t> costs_;  ///< views x count
  std::vector<float> sum_;
  std::vector<std::uint8_t> seen_;
  std::vector<CellCandidate> found_;
};

}  // namespace crane
