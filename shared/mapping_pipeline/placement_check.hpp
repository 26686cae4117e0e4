// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "base/clock.hpp"
#include "cloud/point_cloud.hpp"
#include "mapping/occupancy_map.hpp"

namespace crane {

/// Whether a frame lies where its positions put it: heights and contrast of what it sees, on a
/// grid, are compared with what frames before it saw there, also as if it lay somewhat further
/// along or across. What moved in the workshop changes a part of that; a wrong position all of it.
/// Knows what was seen lately only; memory is bounded. One thread.
class PlacementCheck {
 public:
  /// `cell_m`: of the grid; about a hundredth of what the camera sees.
  explicit PlacementCheck(double cell_m) : cell_m_(cell_m) {}

  enum class Verdict {
    kAgrees,       ///< it fits here, and nowhere else nearly as well
    kContradicts,  ///< it fits clearly better elsewhere
    kUndecided,    ///< too little was seen here before, or it looks the same all around
  };
  struct Finding {
    Verdict verdict = Verdict::kUndecided;
    Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();  ///< kContradicts: where it fits better
  };
  /// `frame` is placed. `closely`: looks at all shifts even if it fits well here.
  /// Cost O(samples + cells), and O(cells x shifts) when looking closely.
  Finding compare(const DepthFrame& frame, TimeNs exposure, bool closely);
  /// The frame that was compared last is right: what it saw is what is known from now on.
  void remember();
  void clear() { patches_.clear(); }

 private:
  struct Cell {
    float height_m = 0, grey = 0;
    TimeNs seen = 0;  ///< 0 = never
  };
  static constexpr int kEdge = 32;
  using Patch = std::array<Cell, std::size_t(kEdge) * kEdge>;
  /// A rectangle of the grid: what one frame saw, or what is known of it.
  struct Raster {
    int x0 = 0, y0 = 0, columns = 0, rows = 0;
    std::vector<float> height_m, grey, weight;  ///< weight 0 = nothing there
    void reset(int x, int y, int width, int height);
  };
  struct Match {
    double fit = -1;  ///< correlation, -1 .. 1; of the channel that tells more
    double cells = 0;
    bool tells = false;  ///< enough cells, and they differ from each other
  };
  void rasterise(const DepthFrame& frame);
  static void to_contrast(Raster& raster);
  void recall(TimeNs exposure, int margin);
  [[nodiscard]] Match match(int dx, int dy, bool heights) const;
  [[nodiscard]] Finding search(bool heights) const;

  double cell_m_;
  std::unordered_map<TileKey, Patch, TileKeyHash> patches_;
  Raster seen_, known_;
  TimeNs exposure_ = 0;
  bool has_grey_ = false;
};

}  // namespace crane
