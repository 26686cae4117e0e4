// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation.hpp"

#include <cstdarg>
#include <cstdio>

namespace crane {
namespace {

[[gnu::format(printf, 2, 3)]] void add(std::string& out, const char* format, ...) {
  char line[400];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  out += line;
}

}  // namespace

Evaluation evaluate(const JudgedMap& map, const TrueSolids& truth,
                    const ClearanceTrialOptions& queries) {
  return {judge(map.occupied(), map.voxel_m(), truth.heights), judge_cells(map, truth),
          try_clearance(truth, map.voxel_m(), ask(map), queries)};
}

std::string cell_report(const CellJudgement& j) {
  std::string out;
  const CellCounts& a = j.all;
  add(out,
      "cells: solid=%zu found=%.4f unknown=%.4f low=%.4f cleared=%.4f (%.0f cm2 in %zu spots) "
      "hollow=%.4f\n",
      a.solid, a.share(a.found), a.share(a.unknown), a.share(a.low), a.share(a.cleared),
      double(a.cleared) * j.cell_m * j.cell_m * 1e4, j.cleared_spots, a.share(a.hollow));
  if (a.cleared > 0)
    add(out, "highest place said to be clear: %.2f m at x %.2f, y %.2f\n", j.worst_m, j.worst_x_m,
        j.worst_y_m);
  if (j.obstacles.empty()) return out;
  add(out, "%-18s %8s %8s %8s %8s %8s %8s\n", "obstacle", "cells", "found", "unknown", "low",
      "cleared", "hollow");
  for (const CellCounts& o : j.obstacles)
    add(out, "%-18s %8zu %8.4f %8.4f %8.4f %8.4f %8.4f\n", o.name.c_str(), o.solid,
        o.share(o.found), o.share(o.unknown), o.share(o.low), o.share(o.cleared),
        o.share(o.hollow));
  return out;
}

std::string clearance_report(const ClearanceTrial& t) {
  std::string out;
  add(out, "clearance: queries=%zu clear=%zu blocked=%zu wrong_clear=%zu\n", t.queries, t.clear,
      t.blocked, t.wrong_clear);
  if (t.wrong_clear == 0) return out;
  const client::Pose& from = t.first.path.front();
  const client::Pose& to = t.first.path.back();
  add(out,
      "first wrong CLEAR: a load of %.2f x %.2f x %.2f m turned by %.2f rad from (%.2f, %.2f) to "
      "(%.2f, %.2f), underside at %.2f m, meets %.3f m at x %.2f, y %.2f\n",
      t.first.load.size_x_m, t.first.load.size_y_m, t.first.load.size_z_m, from.yaw_rad, from.x_m,
      from.y_m, to.x_m, to.y_m, from.z_m, t.first_true_m, t.first_x_m, t.first_y_m);
  return out;
}

}  // namespace crane
