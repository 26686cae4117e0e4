// SPDX-License-Identifier: Apache-2.0
#include "height_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

namespace crane {
namespace {

const cv::Scalar kInk(40, 40, 40);
constexpr int kLeft = 70, kTop = 60, kBottom = 60, kRight = 175;

struct Bounds {
  int column0 = 0, column1 = 0, row0 = 0, row1 = 0;
};

/// The part of the grid where anything is known.
Bounds known_part(const client::HeightGrid& g) {
  Bounds b{int(g.columns), 0, int(g.rows), 0};
  for (int r = 0; r < int(g.rows); ++r)
    for (int c = 0; c < int(g.columns); ++c)
      if (client::is_known(g.cells[std::size_t(r) * g.columns + std::size_t(c)].surface)) {
        b.column0 = std::min(b.column0, c), b.column1 = std::max(b.column1, c + 1);
        b.row0 = std::min(b.row0, r), b.row1 = std::max(b.row1, r + 1);
      }
  return b;
}

void text(cv::Mat& image, const std::string& s, cv::Point at, double size,
          const cv::Scalar& colour = kInk) {
  cv::putText(image, s, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

std::string metres(double m, int digits) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.*f", digits, std::abs(m) < 1e-9 ? 0.0 : m);
  return buffer;
}

cv::Vec3b colour_of(double share) {
  static const cv::Mat table = [] {
    cv::Mat grey(1, 256, CV_8U);
    for (int i = 0; i < 256; ++i) grey.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
    cv::Mat out;
    cv::applyColorMap(grey, out, cv::COLORMAP_TURBO);
    return out;
  }();
  // The ends of turbo are nearly black: leave them out.
  return table.at<cv::Vec3b>(int(18 + std::clamp(share, 0.0, 1.0) * 225));
}

const cv::Vec3b kNothing(232, 232, 232), kHatch(150, 150, 150), kDark(40, 40, 40);

/// What a pixel of the picture shows, in a colour of its own or over that of the height.
enum class Pattern { kPlain, kUnknown, kLowerBound, kOneView };

Pattern pattern_of(const client::Height& c) {
  return !client::is_known(c.surface) ? Pattern::kUnknown
         : c.lower_bound              ? Pattern::kLowerBound
         : c.views == 1               ? Pattern::kOneView
                                      : Pattern::kPlain;
}

cv::Vec3b paint(Pattern pattern, int x, int y, const cv::Vec3b& height) {
  switch (pattern) {
    case Pattern::kUnknown:
      return (x + y) % 9 < 2 ? kHatch : kNothing;
    case Pattern::kLowerBound:
      return (x - y + 9'000'000) % 9 < 2 ? kDark : height;
    case Pattern::kOneView:
      return x % 6 < 2 && y % 6 < 2 ? kDark : height;
    case Pattern::kPlain:
      break;
  }
  return height;
}

/// Red: no-go, amber: slow-down; thin and grey while switched off.
template <class ToX, class ToY>
void draw_zone(cv::Mat& image, const client::Zone& zone, ToX to_x, ToY to_y) {
  const bool no_go = zone.kind == client::Zone::Kind::kNoGo;
  const cv::Scalar colour = !zone.active ? cv::Scalar(120, 120, 120)
                            : no_go      ? cv::Scalar(30, 30, 220)
                                         : cv::Scalar(0, 170, 255);
  std::vector<cv::Point> corners;
  for (const client::Zone::Corner& c : zone.corners) corners.emplace_back(to_x(c.x_m), to_y(c.y_m));
  if (corners.empty()) return;
  if (zone.active) {
    cv::Mat tinted = image.clone();
    cv::fillPoly(tinted, std::vector<std::vector<cv::Point>>{corners}, colour);
    cv::addWeighted(tinted, 0.25, image, 0.75, 0, image);
  }
  cv::polylines(image, std::vector<std::vector<cv::Point>>{corners}, true, colour,
                zone.active ? 3 : 1, cv::LINE_AA);
  std::string label = std::string(no_go ? "no-go " : "slow-down ") + std::to_string(zone.id) + " " +
                      zone.name + (zone.active ? "" : " (off)");
  if (zone.z_min_m > -100) label += ", from " + metres(zone.z_min_m, 1) + " m";
  if (zone.z_max_m < 1000) label += ", up to " + metres(zone.z_max_m, 1) + " m";
  const cv::Point at = corners[0] + cv::Point(4, -6);
  const cv::Size size = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, 0.42, 1, nullptr);
  cv::rectangle(image, {at.x - 2, at.y - size.height - 2, size.width + 4, size.height + 6},
                cv::Scalar(255, 255, 255), cv::FILLED);
  text(image, label, at, 0.42, colour);
}

/// What the colour of a column says: its height, or how long ago it was seen [s].
double value_of(const client::Height& c, const LiveOverlay* live) {
  if (live == nullptr || !live->ages) return c.height_m;
  return std::max(0.0, double(live->now - c.last_observed_ns) * 1e-9);
}

/// The highest value that has a colour of its own, and how it is written.
struct Scale {
  double high = 1, unit = 1;
  std::string name;
};
Scale scale_of(std::vector<double> known, bool ages) {
  const auto top = known.begin() + std::ptrdiff_t(double(known.size() - 1) * 0.999);
  std::nth_element(known.begin(), top, known.end());
  if (!ages) return {std::max(0.1, *top), 1, " m"};
  const double high = std::max(10.0, *top);
  return high > 7200  ? Scale{high, 3600, " h"}
         : high > 300 ? Scale{high, 60, " min"}
                      : Scale{high, 1, " s"};
}

template <class ToX, class ToY>
void draw_crane(cv::Mat& image, const cv::Rect& area, const LiveOverlay& live, ToX to_x, ToY to_y) {
  cv::Mat part = image(area);  // nothing is drawn beside the map
  const auto at = [&](const LiveOverlay::Point& p) {
    return cv::Point(to_x(p.x_m), to_y(p.y_m)) - area.tl();
  };
  const cv::Scalar white(255, 255, 255), black(0, 0, 0);
  std::vector<cv::Point> corners;
  for (const LiveOverlay::Point& p : live.footprint) corners.push_back(at(p));
  if (!corners.empty())
    for (const auto& [colour, width] : {std::pair{black, 4}, {white, 2}})
      cv::polylines(part, std::vector<std::vector<cv::Point>>{corners}, true, colour, width,
                    cv::LINE_AA);
  if (!live.crane) return;
  const cv::Point middle = at(*live.crane);
  for (const auto& [colour, width] : {std::pair{black, 5}, {white, 2}}) {
    cv::circle(part, middle, 12, colour, width, cv::LINE_AA);
    cv::line(part, middle - cv::Point(22, 0), middle + cv::Point(22, 0), colour, width,
             cv::LINE_AA);
    cv::line(part, middle - cv::Point(0, 22), middle + cv::Point(0, 22), colour, width,
             cv::LINE_AA);
  }
  const std::string label =
      "crane " + metres(live.crane->x_m, 2) + ", " + metres(live.crane->y_m, 2);
  const cv::Size size = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, 0.46, 1, nullptr);
  const cv::Point corner(std::clamp(middle.x + 16, 3, std::max(3, area.width - size.width - 4)),
                         std::clamp(middle.y - 16, size.height + 4, std::max(20, area.height - 4)));
  cv::rectangle(part, {corner.x - 3, corner.y - size.height - 3, size.width + 6, size.height + 8},
                white, cv::FILLED);
  text(part, label, corner, 0.46);
}

}  // namespace

std::array<std::uint8_t, 3> height_colour(double share) {
  const cv::Vec3b c = colour_of(share);
  return {c[2], c[1], c[0]};
}

Result<void> draw_heights(const std::string& png_path, const client::HeightGrid& g,
                          const std::vector<ObstacleHeight>& obstacles,
                          const std::vector<client::Zone>& zones, const std::string& title,
                          const LiveOverlay* live) {
  if (g.cells.empty())
    return Error{ErrorCode::kNotAvailable, png_path, "there is no map to draw", ""};
  const Bounds b = known_part(g);
  if (b.column1 <= b.column0)
    return Error{ErrorCode::kNotAvailable, png_path, "nothing is known of the map yet", ""};
  const int columns = b.column1 - b.column0;
  const int rows = b.row1 - b.row0;
  const double px = std::clamp(1100.0 / columns, 0.25, 24.0);  // pixels a column
  const int width = int(columns * px);
  const int height = int(rows * px);
  const int foot = live == nullptr ? 0 : 12 + 22 * int(live->foot.size());
  cv::Mat image(kTop + std::max(height, 130) + kBottom + foot, kLeft + width + kRight, CV_8UC3,
                cv::Scalar(255, 255, 255));

  const bool ages = live != nullptr && live->ages;
  std::vector<double> known;
  for (const client::Height& c : g.cells)
    if (client::is_known(c.surface)) known.push_back(value_of(c, live));
  const Scale scale = scale_of(known, ages);
  const double high = scale.high;

  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int column = b.column0 + int(x / px);
      const int row = b.row1 - 1 - int(y / px);
      const client::Height& c = g.cells[std::size_t(row) * g.columns + std::size_t(column)];
      image.at<cv::Vec3b>(kTop + y, kLeft + x) =
          paint(pattern_of(c), x, y, colour_of(value_of(c, live) / high));
    }
  cv::rectangle(image, {kLeft - 1, kTop - 1, width + 2, height + 2}, kInk);

  const auto to_x = [&](double m) {
    return kLeft + int(((m - g.origin_x_m) / g.cell_m - b.column0) * px);
  };
  const auto to_y = [&](double m) {
    return kTop + int((b.row1 - (m - g.origin_y_m) / g.cell_m) * px);
  };
  const double span = columns * g.cell_m;
  const double step = span > 30 ? 5 : span > 12 ? 2 : span > 5 ? 1 : 0.5;
  for (double m = std::ceil((g.origin_x_m + b.column0 * g.cell_m) / step) * step;
       to_x(m) <= kLeft + width; m += step) {
    cv::line(image, {to_x(m), kTop + height}, {to_x(m), kTop + height + 5}, kInk);
    text(image, metres(m, step < 1 ? 1 : 0), {to_x(m) - 8, kTop + height + 20}, 0.42);
  }
  for (double m = std::ceil((g.origin_y_m + b.row0 * g.cell_m) / step) * step; to_y(m) >= kTop;
       m += step) {
    cv::line(image, {kLeft - 6, to_y(m)}, {kLeft - 1, to_y(m)}, kInk);
    text(image, metres(m, step < 1 ? 1 : 0), {kLeft - 36, to_y(m) + 5}, 0.42);
  }
  text(image, "x along the runway [m]", {kLeft + width / 2 - 80, kTop + height + 42}, 0.48);
  text(image, "y [m]", {10, kTop + 14}, 0.48);
  text(image, title, {kLeft, 34}, 0.62);

  for (const client::Zone& zone : zones) draw_zone(image, zone, to_x, to_y);
  if (live != nullptr) {
    draw_crane(image, {kLeft, kTop, width, height}, *live, to_x, to_y);
    text(image, live->warning, {kLeft, 54}, 0.55, cv::Scalar(30, 30, 220));
    int y = image.rows - foot + 8;
    for (const std::string& line : live->foot) text(image, line, {kLeft, y}, 0.48), y += 22;
  }
  for (const ObstacleHeight& o : obstacles) {
    if (o.columns == 0) continue;
    const std::string label = o.name + " " + metres(o.measured_m, 3) + " m";
    const cv::Size size = cv::getTextSize(label, cv::FONT_HERSHEY_SIMPLEX, 0.46, 1, nullptr);
    const cv::Point at(std::clamp(to_x(o.x_m) - size.width / 2, kLeft, kLeft + width - size.width),
                       to_y(o.y_m) + 5);
    cv::rectangle(image, {at.x - 3, at.y - size.height - 3, size.width + 6, size.height + 8},
                  cv::Scalar(255, 255, 255), cv::FILLED);
    text(image, label, at, 0.46);
  }

  const int bar_x = kLeft + width + 30;
  const int bar_height = std::max(40, height - 130);
  for (int y = 0; y < bar_height; ++y)
    cv::line(image, {bar_x, kTop + y}, {bar_x + 22, kTop + y},
             cv::Scalar(colour_of(1 - double(y) / bar_height)));
  cv::rectangle(image, {bar_x, kTop, 23, bar_height}, kInk);
  for (int i = 0; i <= 4; ++i)
    text(image, metres(high / scale.unit * (4 - i) / 4, ages ? 0 : 2) + (i == 0 ? scale.name : ""),
         {bar_x + 30, kTop + bar_height * i / 4 + 5}, 0.42);
  const auto share = [&](Pattern pattern) {
    const auto count = std::count_if(g.cells.begin(), g.cells.end(),
                                     [pattern](const auto& c) { return pattern_of(c) == pattern; });
    return " " + metres(100.0 * double(count) / double(known.size()), 1) + " %";
  };
  int line_y = kTop + bar_height + 25;
  for (const auto& [pattern, label, of] :
       {std::tuple{Pattern::kUnknown, "unknown", std::string()},
        {Pattern::kLowerBound, "may be higher", share(Pattern::kLowerBound)},
        {Pattern::kOneView, "one view", share(Pattern::kOneView)}}) {
    for (int y = 0; y < 18; ++y)
      for (int x = 0; x < 22; ++x)
        image.at<cv::Vec3b>(line_y + y, bar_x + x) = paint(pattern, x, y, colour_of(0.3));
    text(image, label, {bar_x + 30, line_y + 9}, 0.42);
    text(image, of, {bar_x + 26, line_y + 24}, 0.42);
    line_y += 30;
  }

  bool written = false;
  try {
    written = cv::imwrite(png_path, image);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written)
    return Error{ErrorCode::kResource, png_path, "cannot be written",
                 "check permissions and free space"};
  return {};
}

}  // namespace crane
