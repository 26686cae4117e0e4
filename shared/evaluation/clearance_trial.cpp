// SPDX-License-Identifier: Apache-2.0
#include "evaluation/clearance_trial.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "client/swept_area.hpp"
#include "geometry/convex_polygon.hpp"

namespace crane {
namespace {

using client::ClearanceQuery;

constexpr double kNearby = 0.6;                  ///< [m] from a true cell
constexpr double kShortest = 0.1, kLongest = 2;  ///< sides of a load [m]
constexpr double kLowest = 0.03;                 ///< underside above the floor [m]
constexpr double kAbove = 0.4;                   ///< [m] over the highest thing
constexpr double kFarthest = 3;                  ///< length of a leg [m]

/// Numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (double(engine_() >> 11U) / 9'007'199'254'740'992.0);
  }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }

 private:
  std::mt19937_64 engine_;
};

struct Targets {
  std::vector<std::uint32_t> seen, solid;  ///< cells
  double highest_m = 0;
};

Targets targets_of(const TrueSolids& truth, double voxel_m) {
  Targets out;
  const double tolerance = std::max(0.05, 1.5 * voxel_m);
  for (std::size_t cell = 0; cell < truth.heights.height_mm.size(); ++cell) {
    if (!truth.heights.seen(cell)) continue;
    out.seen.push_back(static_cast<std::uint32_t>(cell));
    const double h = truth.heights.height_m(cell);
    if (h >= tolerance) out.solid.push_back(static_cast<std::uint32_t>(cell));
    out.highest_m = std::max(out.highest_m, h);
  }
  return out;
}

ClearanceQuery make_query(const TrueSolids& truth, const Targets& targets, double margin_m,
                          Random& random) {
  const bool near = !targets.solid.empty() && random.below(2) == 0;
  const std::vector<std::uint32_t>& cells = near ? targets.solid : targets.seen;
  const std::size_t cell = cells[random.below(cells.size())];
  ClearanceQuery q;
  q.margins = {};
  q.margins.horizontal_m = q.margins.vertical_m = margin_m;
  const auto side = [&] {
    return kShortest * std::pow(kLongest / kShortest, random.between(0, 1));
  };
  q.load.size_x_m = side();
  q.load.size_y_m = side();
  q.load.size_z_m = side();
  q.load.above_m = 0;
  client::Pose pose;
  const double reach = near ? kNearby : 0;
  pose.x_m = truth.heights.x_m(cell) + random.between(-reach, reach);
  pose.y_m = truth.heights.y_m(cell) + random.between(-reach, reach);
  pose.yaw_rad = random.between(0, 3.141592653589793);
  pose.z_m = near ? random.between(kLowest, truth.heights.height_m(cell) + 0.15)
                  : random.between(kLowest, targets.highest_m + kAbove);
  q.path.push_back(pose);
  if (random.below(2) == 0) {
    const double length = random.between(0, kFarthest);
    const double direction = random.between(0, 6.283185307179586);
    pose.x_m += length * std::cos(direction);
    pose.y_m += length * std::sin(direction);
    q.path.push_back(pose);
  }
  return q;
}

}  // namespace

std::int64_t cell_hit(const TrueSolids& truth, ClearanceQuery query) {
  query.margins = {};
  query.margins.horizontal_m = query.margins.vertical_m = 0;
  const HeightMap& h = truth.heights;
  std::int64_t hit = -1;
  for (client::SweptPiece& piece : client::sweep(query, h.cell_m)) {
    for (Corner& corner : piece.hull) corner.x -= h.origin_x_m, corner.y -= h.origin_y_m;
    for (const PolygonRow& row : rows_of(piece.hull, h.cell_m)) {
      if (row.row < 0 || row.row >= int(h.rows)) continue;
      for (int c = std::max(0, row.first); c <= std::min(row.last, int(h.columns) - 1); ++c) {
        const std::size_t cell = std::size_t(row.row) * h.columns + std::size_t(c);
        if (!h.seen(cell)) continue;
        const double top = h.height_m(cell);
        if (top <= piece.low_m) continue;
        const double bottom = truth.bottom_m(cell);
        if (std::min(bottom, top - 1e-3) >= piece.high_m) continue;
        if (hit < 0 || top > h.height_m(std::size_t(hit))) hit = std::int64_t(cell);
      }
    }
  }
  return hit;
}

Ask ask(const JudgedMap& map) {
  return [view = map.view()](const ClearanceQuery& query) {
    return client::check_clearance(query, view, 1);
  };
}

ClearanceTrial try_clearance(const TrueSolids& truth, double voxel_m, const Ask& ask,
                             const ClearanceTrialOptions& options) {
  ClearanceTrial out;
  const Targets targets = targets_of(truth, voxel_m);
  if (targets.seen.empty()) return out;
  const double margin_m = options.margin_m < 0 ? voxel_m : options.margin_m;
  Random random(options.seed);
  for (; out.queries < options.queries; ++out.queries) {
    const ClearanceQuery query = make_query(truth, targets, margin_m, random);
    const client::Clearance answer = ask(query);
    out.blocked += answer.verdict == client::Verdict::kBlocked;
    out.invalid += answer.verdict == client::Verdict::kInvalid;
    if (answer.verdict != client::Verdict::kClear) continue;
    ++out.clear;
    const std::int64_t hit = cell_hit(truth, query);
    if (hit < 0) continue;
    if (out.wrong_clear++ > 0) continue;
    out.first = query;
    out.first_x_m = truth.heights.x_m(std::size_t(hit));
    out.first_y_m = truth.heights.y_m(std::size_t(hit));
    out.first_true_m = truth.heights.height_m(std::size_t(hit));
  }
  return out;
}

}  // namespace crane
