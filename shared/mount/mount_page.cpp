// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "base/format.hpp"
#include "calibration/escaped.hpp"
#include "mount/mount_files.hpp"

namespace crane {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1c2733;--soft:#5b6b7a;--line:#d4dbe2;--card:#f5f7f9}
*{box-sizing:border-box}body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:#fff;margin:0 auto;max-width:1060px;padding:28px}
h1{font-size:26px;margin:0}h2{font-size:18px;margin:34px 0 8px;border-bottom:1px solid var(--line);padding-bottom:4px}
.sub{color:var(--soft);margin:2px 0 18px}.verdict{border:2px solid var(--ink);border-radius:6px;padding:14px 18px;font-size:18px;font-weight:600}
.verdict.usable{border-color:#b26a00}.verdict.bad{border-color:#b3261e}.verdict small{display:block;font-weight:400;font-size:14px}
table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:5px 10px 5px 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n{font-variant-numeric:tabular-nums;white-space:nowrap}.two{display:grid;grid-template-columns:1fr 1fr;gap:20px}
figure{margin:0}figcaption{color:var(--soft);font-size:13px}svg{width:100%;height:auto;display:block;background:var(--card);border:1px solid var(--line)}
svg text{font:11px system-ui,sans-serif;fill:var(--soft)}.note{color:var(--soft);font-size:13px}li{margin:3px 0}
@media print{body{padding:0;max-width:none}h2{break-after:avoid}figure,table,.verdict{break-inside:avoid}}
@media(max-width:700px){.two{grid-template-columns:1fr}})";

/// Values as a picture: x to the right, y up, with the least and largest of both written.
class Plot {
 public:
  Plot(double x0, double x1, double y0, double y1, bool same_scale)
      : x0_(x0), x1_(std::max(x1, x0 + 1e-6)), y0_(y0), y1_(std::max(y1, y0 + 1e-6)) {
    per_x_ = (kWidth - 2 * kEdge) / (x1_ - x0_);
    per_y_ = (kHeight - 2 * kEdge) / (y1_ - y0_);
    if (same_scale) per_x_ = per_y_ = std::min(per_x_, per_y_);
  }
  void dot(double x, double y, double size, const char* colour) {
    body_ +=
        formatted("<circle cx='%.1f' cy='%.1f' r='%.1f' fill='%s'/>", px(x), py(y), size, colour);
  }
  void line(const std::vector<double>& x, const std::vector<double>& y, const char* colour) {
    body_ += formatted("<polyline fill='none' stroke='%s' stroke-width='1.4' points='", colour);
    for (std::size_t i = 0; i < x.size(); ++i) body_ += formatted("%.1f,%.1f ", px(x[i]), py(y[i]));
    body_ += "'/>";
  }
  [[nodiscard]] std::string svg(const char* x_unit, const char* y_unit) const {
    return formatted("<svg viewBox='0 0 %.0f %.0f'>", kWidth, kHeight) + body_ +
           formatted("<text x='%.0f' y='%.0f'>%.*f %s</text>", kEdge, kHeight - 8, places(x0_, x1_),
                     x0_, x_unit) +
           formatted("<text x='%.0f' y='%.0f' text-anchor='end'>%.*f %s</text>", px(x1_),
                     kHeight - 8, places(x0_, x1_), x1_, x_unit) +
           formatted("<text x='4' y='%.0f'>%.*f %s</text>", py(y0_), places(y0_, y1_), y0_,
                     y_unit) +
           formatted("<text x='4' y='%.0f'>%.*f %s</text></svg>", py(y1_) + 4, places(y0_, y1_),
                     y1_, y_unit);
  }

 private:
  static constexpr double kWidth = 480, kHeight = 300, kEdge = 56;
  /// Digits behind the point, by the range: -0.0008 of a metre is 0.
  [[nodiscard]] static int places(double low, double high) {
    return std::clamp(2 - static_cast<int>(std::floor(std::log10(high - low))), 0, 4);
  }
  [[nodiscard]] double px(double x) const { return kEdge + (x - x0_) * per_x_; }
  [[nodiscard]] double py(double y) const { return kHeight - kEdge - (y - y0_) * per_y_ + 20; }
  double x0_, x1_, y0_, y1_, per_x_ = 1, per_y_ = 1;
  std::string body_;
};

std::string place_picture(const DriveFacts& d) {
  Eigen::Vector2d low = d.path_m.front();
  Eigen::Vector2d high = low;
  for (const auto& p : d.path_m) low = low.cwiseMin(p), high = high.cwiseMax(p);
  for (const auto& p : d.points_m)
    low = low.cwiseMin(p.head<2>()), high = high.cwiseMax(p.head<2>());
  Plot plot(low.x(), high.x(), low.y(), high.y(), true);
  const std::size_t every = 1 + d.points_m.size() / 2500;
  for (std::size_t i = 0; i < d.points_m.size(); i += every)
    plot.dot(d.points_m[i].x(), d.points_m[i].y(), 1.3, d.is_floor[i] ? "#9bb4c9" : "#b26a00");
  std::vector<double> x, y;
  for (const auto& p : d.path_m) x.push_back(p.x()), y.push_back(p.y());
  plot.line(x, y, "#0b5c9e");
  return plot.svg("m", "m");
}

std::string height_picture(const DriveFacts& d) {
  double low = 0, high = 0.1, x0 = d.points_m.front().x(), x1 = x0;
  for (const auto& p : d.points_m) {
    low = std::min(low, p.z()), high = std::max(high, p.z());
    x0 = std::min(x0, p.x()), x1 = std::max(x1, p.x());
  }
  Plot plot(x0, x1, low, high, false);
  const std::size_t every = 1 + d.points_m.size() / 2500;
  for (std::size_t i = 0; i < d.points_m.size(); i += every)
    plot.dot(d.points_m[i].x(), d.points_m[i].z(), 1.3, d.is_floor[i] ? "#9bb4c9" : "#b26a00");
  return plot.svg("m", "m");
}

/// Of one axis over time [mm].
std::string reading_picture(const DriveFacts& d, int axis) {
  std::vector<double> off;
  double most = 1;
  for (const auto& o : d.reading_off_m) {
    off.push_back(1e3 * o[axis]);
    most = std::max(most, std::abs(off.back()));
  }
  Plot plot(d.time_s.front(), d.time_s.back(), -most, most, false);
  plot.line({d.time_s.front(), d.time_s.back()}, {0, 0}, "#d4dbe2");
  plot.line(d.time_s, off, axis == 0 ? "#0b5c9e" : "#b26a00");
  return plot.svg("s", "mm");
}

std::string value_rows(const MountCalibration& c) {
  std::string out = "<table>";
  for (const MountValue& v : c.values) {
    const MountItemName& name = name_of(v.item);
    out += formatted("<tr><td>%s</td>", name.what);
    if (!v.determined)
      out += "<td class='n'>not determined</td><td class='note'>" + escaped(v.why_not) + "</td>";
    else if (name.decimals == 0)
      out += formatted("<td class='n'>%+.0f</td><td></td>", v.value);
    else
      out += formatted("<td class='n'>%.*f %s</td><td class='n'>&plusmn; %.*f</td>", name.decimals,
                       v.value, name.unit, name.decimals, v.sigma);
    out += "</tr>";
  }
  return out + "</table>";
}

std::string drive_rows(const DriveFacts& d) {
  std::string out = "<table>";
  const auto row = [&out](const char* what, const std::string& value) {
    out += formatted("<tr><td>%s</td><td class='n'>", what) + value + "</td></tr>";
  };
  row("Drive", formatted("%.0f s, %zu frames looked at", d.seconds, d.frames));
  row("Way of bridge, trolley", formatted("%.2f m, %.2f m", d.way_m.x(), d.way_m.y()));
  row("Largest speed", formatted("%.2f, %.2f m/s", d.speed_mps.x(), d.speed_mps.y()));
  row("Points followed", formatted("%zu, of these %zu on the floor", d.tracks, d.floor_tracks));
  row("Left out", formatted("%zu come along with the camera, %zu move by themselves",
                            d.moving_with_camera, d.moving_by_itself));
  row("The fit leaves of a pixel", formatted("%.2f px", d.pixel_sigma));
  row("Of readings", formatted("%.1f mm bridge, %.1f mm trolley", 1e3 * d.reading_sigma_m.x(),
                               1e3 * d.reading_sigma_m.y()));
  row("Of the floor's evenness", formatted("%.1f mm", 1e3 * d.floor_sigma_m));
  row("Readings dropped",
      formatted("%zu bridge, %zu trolley", d.dropped_readings[0], d.dropped_readings[1]));
  return out + "</table>";
}

}  // namespace

std::string mount_page(const MountCalibration& c, const std::string& title) {
  static constexpr const char* kClass[] = {"good", "usable", "bad"};
  static constexpr const char* kText[] = {"Good: can be used", "Usable, with what is said below",
                                          "Bad: nothing was written"};
  const auto verdict = static_cast<std::size_t>(c.verdict);
  std::string out =
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width'><title>Mount " +
      escaped(title) + "</title><style>" + kStyle +
      "</style></head><body><h1>The camera's mount</h1><p class='sub'>" + escaped(title) + "</p>";
  out += formatted("<div class='verdict %s'>%s", kClass[verdict], kText[verdict]);
  const MountValue& h = c.of(MountItem::kHeight);
  if (h.determined)
    out += formatted("<small>The camera hangs %.4f &plusmn; %.4f m above the floor.</small>",
                     h.value, h.sigma);
  out += "</div>";
  if (!c.remarks.empty()) {
    out += "<h2>To be known, and what to do</h2><ul>";
    for (const std::string& remark : c.remarks) out += "<li>" + escaped(remark) + "</li>";
    out += "</ul>";
  }
  out += "<h2>Values</h2>" + value_rows(c);
  if (!c.targets.empty()) {
    out += "<h2>Targets of known height (not used in the fit)</h2><table>";
    for (const TargetCheck& t : c.targets)
      out += formatted("<tr><td>at %.2f, %.2f m</td><td class='n'>%.3f m told</td>",
                       t.target.place_m.x(), t.target.place_m.y(), t.target.height_m) +
             (t.seen ? formatted("<td class='n'>%.3f &plusmn; %.3f m</td><td>%s</td></tr>",
                                 t.height_m, t.sigma_m, t.agrees ? "agrees" : "does not agree")
                     : "<td>not seen</td><td></td></tr>");
    out += "</table>";
  }
  const DriveFacts& d = c.drive;
  if (!d.path_m.empty() && !d.points_m.empty()) {
    out += "<h2>The drive</h2><div class='two'><figure>" + place_picture(d) +
           "<figcaption>From above: way of the camera (blue), floor (grey), what stands on it "
           "(brown)</figcaption></figure><figure>" +
           height_picture(d) +
           "<figcaption>Heights along the runway [m]: the floor must lie level at "
           "0</figcaption></figure></div>";
    out += "<h2>Readings against images</h2><div class='two'>";
    for (const int axis : {0, 1})
      out +=
          "<figure>" + reading_picture(d, axis) +
          formatted("<figcaption>%s's rangefinder minus what the images say</figcaption></figure>",
                    axis == 0 ? "Bridge" : "Trolley");
    out += "</div><h2>Facts</h2>" + drive_rows(d);
  }
  return out + "</body></html>\n";
}

}  // namespace crane
