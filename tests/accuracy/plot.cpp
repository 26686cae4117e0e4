// SPDX-License-Identifier: Apache-2.0
#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crane::accuracy {
namespace {

constexpr double kWidth = 620, kHeight = 300, kLeft = 70, kRight = 150, kTop = 36, kBottom = 56;
constexpr std::array<const char*, 5> kColours = {"#1565c0", "#c62828", "#2e7d32", "#6a1b9a",
                                                 "#ef6c00"};

std::string tag(const char* name, const std::string& attributes, const std::string& content = "") {
  return "<" + std::string(name) + " " + attributes + ">" + content + "</" + name + ">\n";
}

std::string at(const char* x, double vx, const char* y, double vy) {
  return std::string(x) + "=\"" + fixed(vx, 1) + "\" " + y + "=\"" + fixed(vy, 1) + "\" ";
}

std::string words(double x, double y, const std::string& anchor, const std::string& text,
                  const std::string& more = "") {
  return tag("text", at("x", x, "y", y) + "text-anchor=\"" + anchor + "\" " + more, text);
}

/// Powers of ten around all that is drawn.
struct Axis {
  int low = 0, high = 1;
  explicit Axis(const Plot& plot) {
    double least = 1e300;
    double most = 0;
    const auto see = [&](double v) {
      if (!(v > 0)) return;
      least = std::min(least, v);
      most = std::max(most, v);
    };
    for (const Line& line : plot.lines)
      for (const double v : line.values) see(v);
    see(plot.limit);
    if (most == 0) return;
    low = static_cast<int>(std::floor(std::log10(least)));
    high = std::max(low + 1, static_cast<int>(std::ceil(std::log10(most))));
  }
  [[nodiscard]] double y(double value) const {
    const double share = (std::log10(value) - low) / (high - low);
    return kHeight - kBottom - share * (kHeight - kTop - kBottom);
  }
};

}  // namespace

std::string to_svg(const Plot& plot) {
  const Axis axis(plot);
  const double right = kWidth - kRight;
  const double floor = kHeight - kBottom;
  const double step =
      (right - kLeft) / std::max<double>(1, static_cast<double>(plot.labels.size()));
  const auto x = [&](std::size_t i) { return kLeft + (static_cast<double>(i) + 0.5) * step; };
  std::string out =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"620\" height=\"300\" "
      "font-family=\"sans-serif\" font-size=\"12\" fill=\"#333\">\n" +
      tag("rect", "width=\"620\" height=\"300\" fill=\"#fff\"") +
      words(kLeft, 20, "start", plot.title, "font-weight=\"bold\"");
  for (int decade = axis.low; decade <= axis.high; ++decade) {
    const double y = axis.y(std::pow(10.0, decade));
    out += tag("line", at("x1", kLeft, "y1", y) + at("x2", right, "y2", y) + "stroke=\"#ddd\"");
    out += words(kLeft - 8, y + 4, "end", fixed(std::pow(10.0, decade), std::max(0, -decade)));
  }
  for (std::size_t i = 0; i < plot.labels.size(); ++i)
    out += words(x(i), floor + 18, "middle", plot.labels[i]);
  out += words((kLeft + right) / 2, kHeight - 12, "middle", plot.x_axis);
  const double middle = (kTop + floor) / 2;
  out += words(16, middle, "middle", plot.y_axis,
               "transform=\"rotate(-90 16 " + fixed(middle, 0) + ")\"");
  if (plot.limit > 0) {
    const double y = axis.y(plot.limit);
    out += tag("line", at("x1", kLeft, "y1", y) + at("x2", right, "y2", y) +
                           "stroke=\"#777\" stroke-dasharray=\"5 4\"");
    out += words(right + 8, y + 4, "start", "required");
  }
  for (std::size_t n = 0; n < plot.lines.size(); ++n) {
    const Line& line = plot.lines[n];
    const std::string colour = kColours[n % kColours.size()];
    std::string points;
    for (std::size_t i = 0; i < std::min(line.values.size(), plot.labels.size()); ++i) {
      if (!(line.values[i] > 0)) continue;
      points += fixed(x(i), 1) + "," + fixed(axis.y(line.values[i]), 1) + " ";
      out += tag("circle",
                 at("cx", x(i), "cy", axis.y(line.values[i])) + "r=\"3\" fill=\"" + colour + "\"");
    }
    out += tag("polyline", "points=\"" + points + "\" fill=\"none\" stroke=\"" + colour +
                               "\" stroke-width=\"2\"");
    const double y = kTop + 16 + 18 * static_cast<double>(n);
    out += tag("line", at("x1", right + 8, "y1", y) + at("x2", right + 26, "y2", y) + "stroke=\"" +
                           colour + "\" stroke-width=\"2\"");
    out += words(right + 32, y + 4, "start", line.name);
  }
  return out + "</svg>";
}

}  // namespace crane::accuracy
