#include "mapping/map_judge.hpp"

#include <algorithm>
#include <cmath>

#include "base/expects.hpp"

namespace crane {
namespace {

constexpr float kNothing = -99;

struct Grid {
  int width = 0, height = 0;
  std::vector<float> cells;
  Grid(int w, int h, float fill)
      : width(w), height(h), cells(std::size_t(w) * std::size_t(h), fill) {}
  float& at(int x, int y) { return cells[std::size_t(y) * std::size_t(width) + std::size_t(x)]; }
  [[nodiscard]] float highest_near(int x, int y, int reach) const {
    float high = kNothing;
    for (int b = std::max(0, y - reach); b <= std::min(height - 1, y + reach); ++b)
      for (int a = std::max(0, x - reach); a <= std::min(width - 1, x + reach); ++a)
        high = std::max(high, cells[std::size_t(b) * std::size_t(width) + std::size_t(a)]);
    return high;
  }
};

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : double(part) / double(whole);
}

}  // namespace

Judgement judge(const std::vector<OccupiedCube>& occupied, double voxel_m, const HeightMap& truth) {
  expects(voxel_m > 0 && truth.cell_m > 0, "sizes are positive");
  const int width = int(std::ceil(truth.columns * truth.cell_m / voxel_m)) + 2;
  const int height = int(std::ceil(truth.rows * truth.cell_m / voxel_m)) + 2;
  const auto column = [&](double x) {
    return int(std::floor((x - truth.origin_x_m) / voxel_m + 1e-6));
  };
  const auto row = [&](double y) {
    return int(std::floor((y - truth.origin_y_m) / voxel_m + 1e-6));
  };

  Grid mapped(width, height, kNothing);
  for (const OccupiedCube& o : occupied)
    for (double x = o.x_m - o.size_m / 2 + voxel_m / 2; x < o.x_m + o.size_m / 2; x += voxel_m)
      for (double y = o.y_m - o.size_m / 2 + voxel_m / 2; y < o.y_m + o.size_m / 2; y += voxel_m) {
        const int i = column(x);
        const int j = row(y);
        if (i < 0 || j < 0 || i >= width || j >= height) continue;
        mapped.at(i, j) = std::max(mapped.at(i, j), float(o.z_m + o.size_m / 2));
      }
  Grid highest(width, height, kNothing);
  Grid lowest(width, height, -kNothing);
  for (std::uint32_t r = 0; r < truth.rows; ++r)
    for (std::uint32_t c = 0; c < truth.columns; ++c) {
      const std::uint16_t mm = truth.height_mm[std::size_t(r) * truth.columns + c];
      if (mm == HeightMap::kNeverSeen) continue;
      const int i = column(truth.origin_x_m + (c + 0.5) * truth.cell_m);
      const int j = row(truth.origin_y_m + (r + 0.5) * truth.cell_m);
      const float h = float(mm) / 1000;
      highest.at(i, j) = std::max(highest.at(i, j), h);
      lowest.at(i, j) = std::min(lowest.at(i, j), h);
    }

  Judgement out;
  out.voxel_m = voxel_m;
  out.occupied = occupied.size();
  const double base_tolerance = 1.5 * voxel_m;
  std::size_t with_map = 0, unsafe = 0, missed = 0, unmapped = 0, phantom = 0;
  std::vector<double> errors;
  for (int j = 1; j < height - 1; ++j)
    for (int i = 1; i < width - 1; ++i) {
      const float true_m = highest.at(i, j);
      if (true_m < kNothing / 2) continue;
      ++out.columns;
      const float mapped_m = mapped.at(i, j);
      const bool have = mapped_m > -90;
      with_map += have ? 1 : 0;
      const double tolerance = base_tolerance + 0.02 * std::max(0.0F, true_m);
      if (true_m > base_tolerance && lowest.at(i, j) > base_tolerance) {
        ++out.obstacle_columns;
        const float near_m = mapped.highest_near(i, j, 1);
        if (near_m < -90) {
          ++unmapped;
        } else if (near_m < true_m - tolerance) {
          ++unsafe;
          missed += near_m < base_tolerance ? 1 : 0;
        }
      }
      if (!have) continue;
      phantom += mapped_m > highest.highest_near(i, j, 2) + tolerance ? 1 : 0;
      if (true_m - lowest.at(i, j) < voxel_m / 2)
        errors.push_back(std::abs(mapped_m - voxel_m / 2 - true_m));
    }
  out.coverage = share(with_map, out.columns);
  out.unsafe = share(unsafe, out.obstacle_columns);
  out.missed = share(missed, out.obstacle_columns);
  out.unmapped_obstacle = share(unmapped, out.obstacle_columns);
  out.phantom = share(phantom, with_map);
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&errors](double p) {
    return errors.empty() ? -1 : errors[std::size_t(p * double(errors.size() - 1))];
  };
  out.error_median_m = quantile(0.5);
  out.error_p95_m = quantile(0.95);
  return out;
}

}  // namespace crane
