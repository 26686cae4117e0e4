// SPDX-License-Identifier: Apache-2.0
#include "evaluation/cell_judge.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr double kJustBelow = 1e-4;  ///< [m] below a top: still in its voxel
constexpr double kOffFloor = 0.02;   ///< [m] the cube of a low thing ends here

class Judge {
 public:
  Judge(const JudgedMap& map, const TrueSolids& truth)
      : map_(map),
        truth_(truth),
        voxel_(map.voxel_m()),
        tolerance_(std::max(0.05, 1.5 * voxel_)),
        half_(std::max(0.05, voxel_)) {}

  /// Columns that the cube spans on either side, at steps of a voxel.
  [[nodiscard]] bool cleared(double x, double y, double h) const {
    const double depth = std::min(2 * half_, h - kOffFloor);
    return each_column(x, y, [&](int i, int j) {
      for (double dz = -depth; dz <= 1e-9; dz += voxel_)
        if (map_.at(i, j, map_.index(h - kJustBelow + dz)) != Occupancy::kFree) return false;
      return true;
    });
  }

  /// A cube of free space within the matter of the cell's obstacle, which reaches as far sideways.
  [[nodiscard]] bool hollow(std::size_t cell, double x, double y, double h) const {
    const double bottom = truth_.bottom_m(cell);
    if (h - bottom < 2 * half_) return false;
    for (const double dx : {-half_, half_})
      for (const double dy : {-half_, half_}) {
        const std::int64_t corner = truth_.cell_at(x + dx, y + dy);
        if (corner < 0 || truth_.owner[std::size_t(corner)] != truth_.owner[cell]) return false;
      }
    const int needed = int(std::ceil(2 * half_ / voxel_ - 1e-9));
    int run = 0;
    for (int z = int(std::ceil(bottom / voxel_ - 1e-9)); (z + 1) * voxel_ <= h + 1e-9; ++z) {
      const bool free =
          each_column(x, y, [&](int i, int j) { return map_.at(i, j, z) == Occupancy::kFree; });
      run = free ? run + 1 : 0;
      if (run >= needed) return true;
    }
    return false;
  }

  [[nodiscard]] CellVerdict verdict(double x, double y, double h) const {
    double top = -99;
    const int i = map_.index(x), j = map_.index(y);
    for (int q = -1; q <= 1; ++q)
      for (int p = -1; p <= 1; ++p) top = std::max(top, map_.top_m(i + p, j + q));
    // As floats: tops are multiples of the voxel, and ties are to fall as they always did.
    if (double(float(top)) >= h - tolerance_ - 0.02 * h) return CellVerdict::kFound;
    return map_.at(i, j, map_.index(h - kJustBelow)) == Occupancy::kFree ? CellVerdict::kLow
                                                                         : CellVerdict::kUnknown;
  }

  [[nodiscard]] bool solid(double h) const { return h >= tolerance_; }
  [[nodiscard]] bool mapped(double x, double y) const {
    return std::isfinite(map_.top_m(map_.index(x), map_.index(y)));
  }
  [[nodiscard]] double tolerance() const { return tolerance_; }

 private:
  template <class Fn>
  [[nodiscard]] bool each_column(double x, double y, Fn fn) const {
    for (double dx = -half_; dx <= half_ + 1e-9; dx += voxel_)
      for (double dy = -half_; dy <= half_ + 1e-9; dy += voxel_)
        if (!fn(map_.index(x + dx), map_.index(y + dy))) return false;
    return true;
  }

  const JudgedMap& map_;
  const TrueSolids& truth_;
  double voxel_, tolerance_, half_;
};

/// Cells mapped higher than anything true within two columns.
std::vector<std::uint8_t> phantoms(const JudgedMap& map, const HeightMap& truth, double tolerance) {
  const int first_x = map.index(truth.origin_x_m + truth.cell_m / 2);
  const int first_y = map.index(truth.origin_y_m + truth.cell_m / 2);
  const int width = map.index(truth.x_m(truth.columns - 1)) - first_x + 1;
  const int height = map.index(truth.y_m(truth.height_mm.size() - 1)) - first_y + 1;
  constexpr double kNothing = -1e9;
  std::vector<double> high(std::size_t(width) * std::size_t(height), kNothing);
  const auto at = [&](int x, int y) {
    return std::size_t(y) * std::size_t(width) + std::size_t(x);
  };
  for (std::size_t cell = 0; cell < truth.height_mm.size(); ++cell)
    if (truth.seen(cell)) {
      double& h =
          high[at(map.index(truth.x_m(cell)) - first_x, map.index(truth.y_m(cell)) - first_y)];
      h = std::max(h, truth.height_m(cell));
    }
  std::vector<std::uint8_t> bad(high.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double top = map.top_m(x + first_x, y + first_y);
      if (high[at(x, y)] == kNothing || !std::isfinite(top)) continue;
      double near = kNothing;
      for (int q = std::max(0, y - 2); q <= std::min(height - 1, y + 2); ++q)
        for (int p = std::max(0, x - 2); p <= std::min(width - 1, x + 2); ++p)
          near = std::max(near, high[at(p, q)]);
      bad[at(x, y)] = top > near + tolerance + 0.02 * std::max(0.0, near);
    }
  std::vector<std::uint8_t> out(truth.height_mm.size(), 0);
  for (std::size_t cell = 0; cell < out.size(); ++cell)
    if (truth.seen(cell))
      out[cell] =
          bad[at(map.index(truth.x_m(cell)) - first_x, map.index(truth.y_m(cell)) - first_y)];
  return out;
}

/// Spots of cleared cells that touch each other, corners included.
std::size_t spots(const std::vector<CellVerdict>& verdicts, const HeightMap& truth) {
  std::vector<std::uint8_t> open(verdicts.size());
  for (std::size_t i = 0; i < verdicts.size(); ++i) open[i] = verdicts[i] == CellVerdict::kCleared;
  std::size_t count = 0;
  std::vector<std::size_t> stack;
  for (std::size_t start = 0; start < open.size(); ++start) {
    if (open[start] == 0) continue;
    ++count;
    stack.assign(1, start);
    open[start] = 0;
    while (!stack.empty()) {
      const std::size_t cell = stack.back();
      stack.pop_back();
      const auto c = std::int64_t(cell % truth.columns), r = std::int64_t(cell / truth.columns);
      for (std::int64_t q = r - 1; q <= r + 1; ++q)
        for (std::int64_t p = c - 1; p <= c + 1; ++p) {
          if (p < 0 || q < 0 || p >= truth.columns || q >= truth.rows) continue;
          const auto next = std::size_t(q * truth.columns + p);
          if (open[next] == 0) continue;
          open[next] = 0;
          stack.push_back(next);
        }
    }
  }
  return count;
}

}  // namespace

CellJudgement judge_cells(const JudgedMap& map, const TrueSolids& truth) {
  const HeightMap& heights = truth.heights;
  const Judge judge(map, truth);
  CellJudgement out;
  out.cell_m = heights.cell_m;
  out.verdicts.assign(heights.height_mm.size(), CellVerdict::kNoTruth);
  out.all.name = "all";
  for (const TrueObstacle& o : truth.obstacles) out.obstacles.push_back({o.name});
  out.obstacles.push_back({"others"});
  for (std::size_t cell = 0; cell < heights.height_mm.size(); ++cell) {
    if (!heights.seen(cell)) continue;
    const double x = heights.x_m(cell), y = heights.y_m(cell), h = heights.height_m(cell);
    CellVerdict& verdict = out.verdicts[cell];
    if (!judge.solid(h)) {
      verdict = judge.mapped(x, y) ? CellVerdict::kFloor : CellVerdict::kBare;
      continue;
    }
    verdict = judge.verdict(x, y, h);
    const bool cleared = judge.cleared(x, y, h);
    const bool hollow = judge.hollow(cell, x, y, h);
    const int owner = truth.owner[cell];
    CellCounts& own =
        owner == TrueSolids::kNobody ? out.obstacles.back() : out.obstacles[std::size_t(owner)];
    for (CellCounts* counts : {&out.all, &own}) {
      ++counts->solid;
      counts->found += verdict == CellVerdict::kFound;
      counts->unknown += verdict == CellVerdict::kUnknown;
      counts->low += verdict == CellVerdict::kLow;
      counts->cleared += cleared;
      counts->hollow += hollow;
    }
    if (hollow) verdict = CellVerdict::kHollow;
    if (!cleared) continue;
    verdict = CellVerdict::kCleared;
    if (h > out.worst_m) out.worst_m = h, out.worst_x_m = x, out.worst_y_m = y;
  }
  if (out.obstacles.back().solid == 0) out.obstacles.pop_back();
  out.cleared_spots = spots(out.verdicts, heights);
  out.phantom = phantoms(map, heights, judge.tolerance());
  return out;
}

}  // namespace crane
