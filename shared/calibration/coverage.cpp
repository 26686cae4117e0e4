// SPDX-License-Identifier: Apache-2.0
#include "calibration/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr int kFewCorners = 10;       ///< in a part of the image
constexpr double kTilted_rad = 0.35;  ///< 20 degrees; less leaves focal length and distance open
constexpr double kCloseUp = 0.4;      ///< of the image's width

std::string part_name(int column, int row) {
  static constexpr const char* kRow[] = {"upper", "middle", "lower"};
  static constexpr const char* kColumn[] = {"left edge", "part left of the middle",
                                            "part right of the middle", "right edge"};
  return std::string(kRow[row]) + " " + kColumn[column];
}

}  // namespace

Coverage coverage_of(const std::vector<View>& views, const ImageSize& size,
                     const std::vector<Eigen::Isometry3d>& poses) {
  Coverage out;
  for (const View& view : views)
    for (const bool right : {false, true}) {
      const Corners& eye = right ? view.right : view.left;
      double least = size.width, most = 0;
      for (const auto& p : eye.pixels) {
        const int column = std::clamp(static_cast<int>(p.x() / size.width * Coverage::kColumns), 0,
                                      Coverage::kColumns - 1);
        const int row = std::clamp(static_cast<int>(p.y() / size.height * Coverage::kRows), 0,
                                   Coverage::kRows - 1);
        ++out.corners[right ? 1 : 0][static_cast<std::size_t>(row * Coverage::kColumns + column)];
        least = std::min(least, p.x());
        most = std::max(most, p.x());
      }
      if (!eye.empty()) out.largest = std::max(out.largest, (most - least) / size.width);
    }
  for (const auto& T : poses) {
    const Eigen::Vector3d n = T.linear().col(2) * (T.linear()(2, 2) < 0 ? -1 : 1);
    // Against the image: a board parallel to it tells nothing of the focal length, wherever it is.
    const double about_x = std::atan2(n.y(), n.z());
    const double about_y = std::atan2(n.x(), n.z());
    out.tilt_x_rad = {std::min(out.tilt_x_rad[0], about_x), std::max(out.tilt_x_rad[1], about_x)};
    out.tilt_y_rad = {std::min(out.tilt_y_rad[0], about_y), std::max(out.tilt_y_rad[1], about_y)};
  }
  return out;
}

std::vector<std::string> wanted(const Coverage& coverage) {
  std::vector<std::string> out;
  const auto turned = [](const std::array<double, 2>& range) { return range[1] - range[0]; };
  if (turned(coverage.tilt_x_rad) < 2 * kTilted_rad)
    out.emplace_back("tilt the board about its horizontal axis by 30 to 45 degrees, both ways");
  if (turned(coverage.tilt_y_rad) < 2 * kTilted_rad)
    out.emplace_back("tilt the board about its vertical axis by 30 to 45 degrees, both ways");
  if (coverage.largest < kCloseUp)
    out.emplace_back("hold the board nearer: it should fill half of the image's width");
  // The parts of the image that were seen least come first.
  std::vector<std::pair<int, std::string>> parts;
  for (const bool right : {false, true})
    for (int row = 0; row < Coverage::kRows; ++row)
      for (int column = 0; column < Coverage::kColumns; ++column) {
        const int seen =
            coverage.corners[right ? 1 : 0]
                            [static_cast<std::size_t>(row * Coverage::kColumns + column)];
        if (seen < kFewCorners)
          parts.emplace_back(seen, "hold the board in the " + part_name(column, row) + " of the " +
                                       (right ? "right" : "left") + " image (" +
                                       std::to_string(seen) + " corners there)");
      }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [seen, text] : parts) out.push_back(std::move(text));
  return out;
}

}  // namespace crane
