// SPDX-License-Identifier: Apache-2.0
#include "evaluation/map_judge.hpp"

#include <algorithm>
#include <array>
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

Judgement judge(const std::vector<MapCube>& occupied, double voxel_m, const HeightMap& truth) {
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
  for (const MapCube& o : occupied) {
    // Only what lies over the truth: the cubes of a strange map may be as large as a plant.
    const auto steps = [&](double centre, double origin, int count) {
      const double first = centre - o.size_m / 2 + voxel_m / 2;
      const double last = std::round(o.size_m / voxel_m) - 1;
      const double low = std::max(0.0, std::floor((origin - first) / voxel_m) - 1);
      const double high = std::min(last, std::ceil((origin - first) / voxel_m + count) + 1);
      return std::array<double, 3>{first, low, high};
    };
    const auto [x0, first_x, last_x] = steps(o.x_m, truth.origin_x_m, width);
    const auto [y0, first_y, last_y] = steps(o.y_m, truth.origin_y_m, height);
    for (double nx = first_x; nx <= last_x; ++nx)
      for (double ny = first_y; ny <= last_y; ++ny) {
        const int i = column(x0 + nx * voxel_m);
        const int j = row(y0 + ny * voxel_m);
        if (i < 0 || j < 0 || i >= width || j >= height) continue;
        mapped.at(i, j) = std::max(mapped.at(i, j), float(o.z_m + o.size_m / 2));
      }
  }
  Grid highest(width, height, kNothing);
  Grid lowest(width, height, -kNothing);
  for (std::uint32_t r = 0; r < truth.rows; ++r)
    for (std::uint32_t c = 0; c < truth.columns; ++c) {
      const std::size_t cell = std::size_t(r) * truth.columns + c;
      if (!truth.seen(cell)) continue;
      const int i = column(truth.origin_x_m + (c + 0.5) * truth.cell_m);
      const int j = row(truth.origin_y_m + (r + 0.5) * truth.cell_m);
      const float h = float(truth.height_mm[cell]) / 1000 + float(truth.offset_m);
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
      const double excess = mapped_m - highest.highest_near(i, j, 2);
      if (mapped_m > highest.highest_near(i, j, 2) + tolerance) {
        ++phantom;
        if (excess > out.phantom_excess_m) {
          out.phantom_excess_m = excess;
          out.phantom_x_m = truth.origin_x_m + (i + 0.5) * voxel_m;
          out.phantom_y_m = truth.origin_y_m + (j + 0.5) * voxel_m;
        }
      }
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
