// SPDX-License-Identifier: Apache-2.0
#include "calibration/svg.hpp"

#include <algorithm>
#include <cmath>

#include "base/format.hpp"
#include "calibration/escaped.hpp"
#include "calibration/guidance.hpp"

namespace crane {
namespace {

std::string image_frame(const ImageSize& size) {
  return formatted("<svg viewBox='-2 -2 %u %u' role='img'>", size.width + 4, size.height + 4) +
         formatted("<rect class='frame' width='%u' height='%u'/>", size.width, size.height);
}

}  // namespace

std::string svg_coverage(const StereoCalibration& c, bool right) {
  std::string out = image_frame(c.size);
  const double w = double(c.size.width) / Coverage::kColumns;
  const double h = double(c.size.height) / Coverage::kRows;
  for (int i = 0; i < Coverage::kColumns * Coverage::kRows; ++i)
    if (c.coverage.corners[right ? 1 : 0][static_cast<std::size_t>(i)] < 10)
      out += formatted("<rect class='missing' x='%.1f' y='%.1f' width='%.1f' height='%.1f'/>",
                       w * (i % Coverage::kColumns), h * (i / Coverage::kColumns), w, h);
  for (const View& view : c.views)
    for (const auto& p : (right ? view.right : view.left).pixels)
      out += formatted("<circle class='corner' cx='%.1f' cy='%.1f' r='%.1f'/>", p.x(), p.y(),
                       c.size.width / 250.0);
  if (const auto next = next_view(c.coverage); next && next->right == right) {
    out += "<polygon class='next' points='";
    for (const auto& p : outline(*next, c.board, c.size))
      out += formatted("%.1f,%.1f ", p.x(), p.y());
    out += "'/>";
  }
  return out + "</svg>";
}

std::string svg_residuals(const StereoCalibration& c, bool right) {
  std::string out = image_frame(c.size);
  const double longer = 0.03 * c.size.width / std::max(1e-3, 2 * c.rig.sigma_px);
  for (const Residual& r : c.residuals)
    if (r.right == right)
      out +=
          formatted("<line class='off' x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f'/>", r.seen.x(),
                    r.seen.y(), r.seen.x() + longer * r.off.x(), r.seen.y() + longer * r.off.y());
  return out + "</svg>" +
         formatted(
             "<p class='note'>Errors are drawn %.0f times as long. Arrows that point the same "
             "way in a part of the image: the lens needs a model with more numbers.</p>",
             longer);
}

std::string svg_grid(const ImageGrid& grid, const ImageSize& size, double scale) {
  std::string out = image_frame(size);
  std::string numbers;  // over all fields, or the next ones would cover them
  const double w = double(size.width) / grid.columns;
  const double h = double(size.height) / grid.rows;
  const double most = std::max(1e-12, grid.worst());
  for (int r = 0; r < grid.rows; ++r)
    for (int column = 0; column < grid.columns; ++column) {
      const double v = grid.values[static_cast<std::size_t>(r * grid.columns + column)];
      const double share = v / most;
      out += formatted(
          "<rect x='%.1f' y='%.1f' width='%.1f' height='%.1f' fill='hsl(210 55%% %.0f%%)'/>",
          w * column, h * r, w + 0.5, h + 0.5, 95 - 60 * share);
      if (r % 3 != 0 || column % 4 != 0) continue;
      const bool first = column == 0;
      const bool last = column + 1 == grid.columns;
      const double x = first ? 3 : last ? size.width - 3 : w * (column + 0.5);
      const char* anchor = first  ? " style='text-anchor:start'"
                           : last ? " style='text-anchor:end'"
                                  : "";
      numbers +=
          formatted("<text x='%.1f' y='%.1f' font-size='%.1f' fill='%s'%s>%.2g</text>", x,
                    h * (r + 0.65), 0.55 * h, share > 0.6 ? "#fff" : "#123", anchor, scale * v);
    }
  return out + numbers + "</svg>";
}

std::string svg_views(const StereoCalibration& c) {
  double most = 1e-6;
  for (const ViewErrors& e : c.errors)
    most = std::max({most, e.left_px, e.right_px, e.epipolar_px});
  const double bar = 14, wide = 320;
  std::string out = formatted("<svg class='bars' viewBox='0 0 520 %.0f' role='img'>",
                              3.6 * bar * double(c.errors.size()) + 4);
  double y = 2;
  for (const ViewErrors& e : c.errors) {
    out += formatted("<text class='name' x='0' y='%.0f' font-size='12'>", y + 2 * bar) +
           escaped(e.name.substr(0, 18)) + "</text>";
    int row = 0;
    for (const double v : {e.left_px, e.right_px, e.epipolar_px}) {
      static constexpr const char* kClass[] = {"left", "right", "rows"};
      out += formatted("<rect class='%s' x='130' y='%.1f' width='%.1f' height='%.0f'/>",
                       kClass[row], y + row * bar, wide * v / most, bar - 2);
      out += formatted("<text x='%.1f' y='%.1f' font-size='11' class='value'>%.3f</text>",
                       136 + wide * v / most, y + row * bar + 10, v);
      ++row;
    }
    y += 3.6 * bar;
  }
  return out + "</svg>";
}

}  // namespace crane
