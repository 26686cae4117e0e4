// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/placement_check.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

/// Older than this the workshop itself may have changed.
constexpr TimeNs kLately = 30 * kNsPerSecond;
/// So long the first look at a place stays the one to compare with: positions that drift away from
/// frame to frame do not take it along.
constexpr TimeNs kKept = 10 * kNsPerSecond;
constexpr std::size_t kMostPatches = 1024;
constexpr double kSamples = 60'000;  ///< of a frame are looked at: several a cell
/// Shifts that are tried, to all four sides [cells]: of what fits well here, and of what does not.
constexpr int kReach = 16, kFarReach = 64;
/// Nearer than this is the same place [cells].
constexpr int kNear = 2;
/// By chance no shift of so few fits: correlation varies by 0.1, and three times that is not 0.6.
constexpr double kLeastCells = 120;
/// What does not differ from cell to cell says nothing of where it is.
constexpr double kLeastHeights_m = 0.05, kLeastContrast = 0.015;
/// Brightness counts by how it differs from that of the cells around, so far away [cells], as a
/// share of it: lamps that switch and exposures that change leave that as it is.
constexpr int kAround = 4;
constexpr float kDark = 8;         ///< [grey levels]; below it noise would count for contrast
constexpr double kGoodFit = 0.6;   ///< correlation of what lies right
constexpr double kClearly = 0.15;  ///< by so much a better fit elsewhere is no chance
constexpr float kHighest_m = 5;    ///< higher counts as this: one mast does not outweigh a hall

int floor_div(int a, int b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

}  // namespace

void PlacementCheck::Raster::reset(int x, int y, int width, int height) {
  x0 = x, y0 = y, columns = width, rows = height;
  const std::size_t cells = std::size_t(columns) * std::size_t(rows);
  height_m.assign(cells, 0);
  grey.assign(cells, 0);
  weight.assign(cells, 0);
}

void PlacementCheck::rasterise(const DepthFrame& f) {
  struct Sample {
    int x, y;
    float z, grey;
  };
  static thread_local std::vector<Sample> samples;
  samples.clear();
  int x0 = 1 << 30, y0 = 1 << 30, x1 = -(1 << 30), y1 = -(1 << 30);
  const auto step = static_cast<std::uint32_t>(
      std::max(1.0, std::ceil(std::sqrt(double(f.width) * f.height / kSamples))));
  const Eigen::Matrix3d R = f.T_map_rectified.linear();
  const Eigen::Vector3d t = f.T_map_rectified.translation();
  for (std::uint32_t v = step / 2; v < f.height; v += step)
    for (std::uint32_t u = step / 2; u < f.width; u += step) {
      const std::size_t i = std::size_t(v) * f.width + u;
      const double z = f.depth_m[i];
      if (!(z > 0) || f.confidence[i] < 64) continue;
      const Eigen::Vector3d p =
          R * Eigen::Vector3d((u - f.cx_px) / f.f_px * z, (v - f.cy_px) / f.f_px * z, z) + t;
      if (!(std::abs(p.x()) < 1e5 && std::abs(p.y()) < 1e5)) continue;
      const int x = static_cast<int>(std::floor(p.x() / cell_m_));
      const int y = static_cast<int>(std::floor(p.y() / cell_m_));
      float grey = 0;
      if (f.colour != nullptr)
        grey = float(f.colour[3 * i] + 2 * f.colour[3 * i + 1] + f.colour[3 * i + 2]) / 4;
      samples.push_back({x, y, std::clamp(float(p.z()), -1.F, kHighest_m), grey});
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  constexpr int kMostCells = 2048;  ///< to a side: what lies beyond is a mismatch far away
  if (samples.empty() || x1 - x0 >= kMostCells || y1 - y0 >= kMostCells)
    return seen_.reset(0, 0, 0, 0);
  seen_.reset(x0, y0, x1 - x0 + 1, y1 - y0 + 1);
  for (const Sample& s : samples) {
    const std::size_t cell =
        std::size_t(s.y - y0) * std::size_t(seen_.columns) + std::size_t(s.x - x0);
    seen_.height_m[cell] += s.z;
    seen_.grey[cell] += s.grey;
    seen_.weight[cell] += 1;
  }
  for (std::size_t i = 0; i < seen_.weight.size(); ++i) {
    if (seen_.weight[i] == 0) continue;
    seen_.height_m[i] /= seen_.weight[i];
    seen_.grey[i] /= seen_.weight[i];
  }
  if (f.colour != nullptr) to_contrast(seen_);
}

/// Brightness to contrast; see kAround.
void PlacementCheck::to_contrast(Raster& r) {
  const auto width = std::size_t(r.columns);
  const auto height = std::size_t(r.rows);
  static thread_local std::vector<float> sums, counts;
  sums.assign(width * height, 0);
  counts.assign(width * height, 0);
  for (std::size_t y = 0; y < height; ++y) {  // along the rows
    float sum = 0, count = 0;
    for (std::size_t x = 0; x < width + kAround; ++x) {
      const auto put = [&](std::size_t at, float sign) {
        const bool there = r.weight[y * width + at] > 0;
        sum += there ? sign * r.grey[y * width + at] : 0;
        count += there ? sign : 0;
      };
      if (x < width) put(x, 1);
      if (x > 2 * kAround) put(x - 2 * kAround - 1, -1);
      if (x >= kAround) {
        sums[y * width + x - kAround] = sum;
        counts[y * width + x - kAround] = count;
      }
    }
  }
  for (std::size_t x = 0; x < width; ++x) {  // and across them
    float sum = 0, count = 0;
    for (std::size_t y = 0; y < height + kAround; ++y) {
      const auto put = [&](std::size_t at, float sign) {
        sum += sign * sums[at * width + x];
        count += sign * counts[at * width + x];
      };
      if (y < height) put(y, 1);
      if (y > 2 * kAround) put(y - 2 * kAround - 1, -1);
      if (y < kAround) continue;
      const std::size_t at = (y - kAround) * width + x;
      if (r.weight[at] == 0 || count < 1) continue;
      const float mean = sum / count;
      r.grey[at] = (r.grey[at] - mean) / (mean + kDark);
    }
  }
}

void PlacementCheck::recall(TimeNs exposure, int margin) {
  known_.reset(seen_.x0 - margin, seen_.y0 - margin, seen_.columns + 2 * margin,
               seen_.rows + 2 * margin);
  for (int ty = floor_div(known_.y0, kEdge); ty * kEdge < known_.y0 + known_.rows; ++ty)
    for (int tx = floor_div(known_.x0, kEdge); tx * kEdge < known_.x0 + known_.columns; ++tx) {
      const auto patch = patches_.find({tx, ty});
      if (patch == patches_.end()) continue;
      for (int y = 0; y < kEdge; ++y)
        for (int x = 0; x < kEdge; ++x) {
          const int column = tx * kEdge + x - known_.x0;
          const int row = ty * kEdge + y - known_.y0;
          const Cell& cell = patch->second[std::size_t(y) * kEdge + std::size_t(x)];
          if (column < 0 || row < 0 || column >= known_.columns || row >= known_.rows ||
              cell.seen == 0 || std::abs(exposure - cell.seen) > kLately)
            continue;
          const std::size_t at =
              std::size_t(row) * std::size_t(known_.columns) + std::size_t(column);
          known_.height_m[at] = cell.height_m;
          known_.grey[at] = cell.grey;
          known_.weight[at] = 1;
        }
    }
}

/// Correlation of what is seen, as if it lay (dx, dy) cells further, with what is known.
PlacementCheck::Match PlacementCheck::match(int dx, int dy, bool heights) const {
  const int margin_x = seen_.x0 + dx - known_.x0;
  const int margin_y = seen_.y0 + dy - known_.y0;
  const std::vector<float>& a_of = heights ? seen_.height_m : seen_.grey;
  const std::vector<float>& b_of = heights ? known_.height_m : known_.grey;
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int y = 0; y < seen_.rows; ++y) {
    const std::size_t from = std::size_t(y) * std::size_t(seen_.columns);
    const std::size_t to = std::size_t(y + margin_y) * std::size_t(known_.columns) +
                           static_cast<std::size_t>(margin_x);
    float rn = 0, ra = 0, rb = 0, raa = 0, rbb = 0, rab = 0;
    for (std::size_t x = 0; x < std::size_t(seen_.columns); ++x) {
      const float both = (seen_.weight[from + x] > 0 ? 1.F : 0.F) * known_.weight[to + x];
      const float a = both * a_of[from + x];
      const float b = both * b_of[to + x];
      rn += both, ra += a, rb += b, raa += a * a, rbb += b * b, rab += a * b;
    }
    n += double(rn), sa += double(ra), sb += double(rb);
    saa += double(raa), sbb += double(rbb), sab += double(rab);
  }
  Match m;
  m.cells = n;
  if (n < kLeastCells) return m;
  const double va = std::max(0.0, saa / n - sa / n * sa / n);
  const double vb = std::max(0.0, sbb / n - sb / n * sb / n);
  const double least = heights ? kLeastHeights_m : kLeastContrast;
  m.tells = va > least * least && vb > least * least;
  if (m.tells) m.fit = (sab / n - sa / n * sb / n) / std::sqrt(va * vb);
  return m;
}

PlacementCheck::Finding PlacementCheck::search(bool heights) const {
  Finding finding;
  const Match here = match(0, 0, heights);
  if (!here.tells) return finding;
  double best = here.fit;  // nearby
  double elsewhere = -1;
  int best_dx = 0, best_dy = 0;
  const int reach = here.fit > kGoodFit ? kReach : kFarReach;
  for (int d = 1; d <= reach; ++d)
    for (const auto& [dx, dy] : {std::pair{d, 0}, {-d, 0}, {0, d}, {0, -d}}) {
      const Match m = match(dx, dy, heights);
      if (!m.tells || m.cells < here.cells / 4) continue;
      if (d < kNear) {
        best = std::max(best, m.fit);
      } else if (m.fit > elsewhere) {
        elsewhere = m.fit;
        best_dx = dx, best_dy = dy;
      }
    }
  if (elsewhere > kGoodFit && elsewhere > best + kClearly) {
    finding.verdict = Verdict::kContradicts;
    finding.shift_m = Eigen::Vector2d(best_dx, best_dy) * cell_m_;
  } else if (here.fit > kGoodFit && best > elsewhere) {
    finding.verdict = Verdict::kAgrees;
  }
  return finding;
}

PlacementCheck::Finding PlacementCheck::compare(const DepthFrame& frame, TimeNs exposure,
                                                bool closely) {
  exposure_ = exposure;
  has_grey_ = frame.colour != nullptr;
  rasterise(frame);
  if (seen_.columns == 0 || patches_.empty()) return {};
  if (!closely) {
    recall(exposure, 0);
    for (const bool heights : {false, true}) {
      if (!heights && !has_grey_) continue;
      const Match here = match(0, 0, heights);
      if (here.tells && here.fit > kGoodFit) return {Verdict::kAgrees, {}};
    }
  }
  recall(exposure, kFarReach);
  // The floor's own look says more than what stands on it, and does not move.
  const Finding by_grey = has_grey_ ? search(false) : Finding{};
  if (by_grey.verdict != Verdict::kUndecided) return by_grey;
  return search(true);
}

void PlacementCheck::remember() {
  for (int y = 0; y < seen_.rows; ++y)
    for (int x = 0; x < seen_.columns; ++x) {
      const std::size_t at = std::size_t(y) * std::size_t(seen_.columns) + std::size_t(x);
      if (seen_.weight[at] == 0) continue;
      const int gx = seen_.x0 + x;
      const int gy = seen_.y0 + y;
      const TileKey key{floor_div(gx, kEdge), floor_div(gy, kEdge)};
      Cell& cell =
          patches_[key][std::size_t(gy - key.y * kEdge) * kEdge + std::size_t(gx - key.x * kEdge)];
      if (cell.seen == 0 || std::abs(exposure_ - cell.seen) > kKept)
        cell = {seen_.height_m[at], seen_.grey[at], exposure_};
    }
  if (patches_.size() <= kMostPatches) return;
  std::erase_if(patches_, [this](const auto& patch) {
    return std::all_of(patch.second.begin(), patch.second.end(), [this](const Cell& cell) {
      return cell.seen == 0 || std::abs(exposure_ - cell.seen) > kLately;
    });
  });
  if (patches_.size() > 2 * kMostPatches) patches_.clear();
}

}  // namespace crane
