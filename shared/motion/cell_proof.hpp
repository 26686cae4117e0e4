// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "motion/cell_sweep.hpp"
#include "motion/cell_window.hpp"

namespace crane {

/// Edge of a cell: what gets one depth, compared by the square of twice its size around it [px].
inline constexpr int kCellEdge = 16;

struct CellFit {
  double inverse_m = 0, sigma = 0;  ///< [1/m]
  std::uint32_t views = 0;
  int count = 0;
};

/// What one pixel of a cell is at the cell's depth.
enum class Borne : std::uint8_t {
  kNot,       ///< some view shows something else
  kLikely,    ///< almost
  kPlain,     ///< all views show the same, but so they would at other depths
  kTextured,  ///< all views show the same, and it has texture
};

/// Pixel by pixel: whether all views, moved by a cell's depth, are the newest image. One thread
/// each.
class CellProof {
 public:
  CellProof(const PlacedImage& image, const ViewSet& set) : image_(image), set_(set) {}

  /// The one candidate that the views bear out, looked at closely; nothing if there is none, or
  /// another one would do as well. `candidates`: the best first.
  std::optional<CellFit> decide(int u0, int v0, const std::vector<CellCandidate>& candidates);
  /// What the pair measured, `inverse_m` +- `sigma` [1/m], finer by the longer baselines of
  /// `views`; nothing where these do not agree with it.
  std::optional<CellFit> sharpen(int u0, int v0, double inverse_m, double sigma,
                                 std::uint32_t views);
  /// Bits of the views that see a cell at this depth.
  std::uint32_t seen_by(int u0, int v0, double inverse_m);
  /// Each pixel of the cell at (u0, v0), 3 x 3 around it, in every view that bore the cell out.
  void look(int u0, int v0, const CellFit& fit, std::array<Borne, kCellEdge * kCellEdge>& out);

 private:
  static constexpr int kMargin = 4, kWindow = kCellEdge + 2 * kMargin;
  static_assert(kWindow == kWindowEdge);
  /// Where the window falls in a view: its first pixel, and how far beyond it.
  struct Place {
    int x = 0, y = 0;
    float fx = 0, fy = 0;
    Eigen::Vector2d motion;  ///< [px] by 1/m
  };
  /// Nothing: outside.
  [[nodiscard]] std::optional<Place> place(int u0, int v0, double inverse_m,
                                           const MotionView& view) const;
  /// What the view differs there from the window that was taken.
  WindowDifference compare(const MotionView& view, const Place& place);
  bool take_window(int u0, int v0);
  /// The depth finer than a pixel: least squares of brightness over the views in one, over the cell
  /// and a few pixels around. Nothing where it does not converge. Of the window that was taken.
  std::optional<CellFit> refine(int u0, int v0, double inverse_m, std::uint32_t views);
  /// What is left of the differences, in what noise gives: the mean over the views, each at most
  /// kHopeless; and how many views show clearly something else.
  double misfit(int u0, int v0, double inverse_m, std::uint32_t views, int* against = nullptr);

  const PlacedImage& image_;
  const ViewSet& set_;
  std::array<float, kWindow * kWindow> here_{}, gx_{}, gy_{}, difference_{};
};

}  // namespace crane
