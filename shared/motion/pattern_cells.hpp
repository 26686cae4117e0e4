// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "motion/pattern_depth.hpp"

namespace crane {

struct PatternReport {
  std::size_t cells = 0;    ///< looked at
  std::size_t put_off = 0;  ///< not looked at for lack of time
  std::size_t told = 0;     ///< that have one depth only
};

/// The cells that the pair matched at one of several disparities, and where the views leave only
/// one of them.
class PatternCells {
 public:
  /// The result is the same for any number of threads.
  explicit PatternCells(int threads) : threads_(threads) {}

  /// `ambiguous_m`: a pixel each, 0 = none. At most about `most` cells, in turn.
  PatternReport look(const DepthFrame& frame, const PlacedImage& image, const ViewSet& set,
                     std::span<const float> ambiguous_m, std::size_t most);
  /// Nothing was looked at.
  void clear() { fits_.clear(); }
  /// Of the frame that was looked at last.
  [[nodiscard]] std::optional<CellFit> at(int row, int column) const;
  /// Of a cell without a depth of its own, between two that have the same, along its row or column
  /// and not far away. It is no proof, but where to look.
  [[nodiscard]] std::optional<CellFit> between(int row, int column) const;

 private:
  [[nodiscard]] std::optional<CellFit> between(int row, int column, int down, int right) const;

  int threads_;
  int rows_ = 0, columns_ = 0, next_row_ = 0;
  std::vector<std::optional<CellFit>> fits_;
};

}  // namespace crane
