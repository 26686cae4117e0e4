// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace crane {

struct Corner {
  double x = 0, y = 0;
};

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain). Of fewer than three
/// points, those.
std::vector<Corner> convex_hull(std::vector<Corner> points);

/// Cells of one row that a polygon touches: columns first .. last.
struct PolygonRow {
  int row = 0, first = 0, last = -1;
};
/// Rows of cells of edge `cell` that a convex polygon touches, from the lowest.
std::vector<PolygonRow> rows_of(const std::vector<Corner>& hull, double cell);

}  // namespace crane
