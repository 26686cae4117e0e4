// SPDX-License-Identifier: Apache-2.0
#include "calibration/report.hpp"

#include <openssl/evp.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "base/format.hpp"
#include "calibration/escaped.hpp"
#include "calibration/guidance.hpp"
#include "calibration/svg.hpp"
#include "calibration/verdict.hpp"

namespace crane {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1c2733;--soft:#5b6b7a;--line:#d4dbe2;--back:#fff;--card:#f5f7f9}
*{box-sizing:border-box}body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--back);margin:0 auto;max-width:1060px;padding:28px}
h1{font-size:26px;margin:0}h2{font-size:18px;margin:34px 0 8px;border-bottom:1px solid var(--line);padding-bottom:4px}
.sub{color:var(--soft);margin:2px 0 18px}.verdict{border:2px solid var(--ink);border-radius:6px;padding:14px 18px;font-size:18px;font-weight:600}
.verdict.usable{border-color:#b26a00}.verdict.bad{border-color:#b3261e}.verdict small{display:block;font-weight:400;font-size:14px}
table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:5px 10px 5px 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n{font-variant-numeric:tabular-nums;white-space:nowrap}.two{display:grid;grid-template-columns:1fr 1fr;gap:20px}
figure{margin:0}figcaption{color:var(--soft);font-size:13px}svg{width:100%;height:auto;display:block}
.frame{fill:var(--card);stroke:var(--line);stroke-width:2}.missing{fill:#b26a00;opacity:.18}.next{fill:none;stroke:#b26a00;stroke-width:6;stroke-dasharray:18 10}.corner{fill:#0b5c9e;opacity:.55}
.off{stroke:#0b5c9e;stroke-width:1.4}.bars{max-width:560px}.bars text{fill:var(--ink)}.bars .left{fill:#0b5c9e}.bars .right{fill:#6aa6d6}.bars .rows{fill:#b26a00}
svg text{text-anchor:middle;font-family:inherit}svg.bars text{text-anchor:start}.note{color:var(--soft);font-size:13px}
img{max-width:100%;border:1px solid var(--line)}li{margin:3px 0}
@media print{body{padding:0;max-width:none}h2{break-after:avoid}figure,table,.verdict{break-inside:avoid}}
@media(max-width:700px){.two{grid-template-columns:1fr}})";

std::string picture(const Image& image) {
  if (image.bytes.empty()) return {};
  const cv::Mat pixels(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC3,
                       const_cast<std::uint8_t*>(image.bytes.data()));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", pixels, jpeg, {cv::IMWRITE_JPEG_QUALITY, 85});
  std::string base64(4 * ((jpeg.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(base64.data()), jpeg.data(),
                                   static_cast<int>(jpeg.size()));
  base64.resize(static_cast<std::size_t>(size));
  return "<h2>A rectified pair</h2><figure><img alt='left and right image, rectified' "
         "src='data:image/jpeg;base64," +
         base64 +
         "'><figcaption>The same thing lies on the same line in both images.</figcaption></figure>";
}

std::string camera_rows(const char* name, const LensNumbers& lens, const RigEstimate& rig,
                        Eigen::Index from) {
  static constexpr const char* kNames[] = {"fx", "fy", "cx", "cy", "k1", "k2",
                                           "p1", "p2", "k3", "k4", "k5", "k6"};
  std::string out;
  for (std::size_t i = 0; i < kLensNumbers; ++i) {
    const double sigma = std::sqrt(rig.covariance(from + Eigen::Index(i), from + Eigen::Index(i)));
    if (sigma == 0) continue;
    out +=
        formatted(i < 4 ? "<tr><td>%s camera, %s</td><td class='n'>%.3f px</td><td class='n'>"
                          "&plusmn; %.3f</td></tr>"
                        : "<tr><td>%s camera, %s</td><td class='n'>%.6f</td><td class='n'>&plusmn; "
                          "%.6f</td></tr>",
                  name, kNames[i], lens[i], sigma);
  }
  return out;
}

std::string figures(const StereoCalibration& c) {
  const double tilt = Eigen::AngleAxisd(c.rig.T_right_left.linear()).angle() * 180 / M_PI;
  std::string out = "<table>";
  const auto row = [&out](const char* what, const std::string& value, const char* meaning) {
    out += formatted("<tr><td>%s</td><td class='n'>", what) + value + "</td><td class='note'>" +
           meaning + "</td></tr>";
  };
  row("Height of the floor",
      formatted("&plusmn; %.2f cm at %.1f m", 100 * c.height_sigma_m.most(), c.floor_m),
      "1 sigma in 95 % of the image, from this calibration alone");
  row("Baseline",
      formatted("%.2f &plusmn; %.2f mm", 1000 * c.rig.baseline_m(),
                1000 * c.rig.baseline_sigma_m()),
      "distance of the two cameras");
  row("Angle between the cameras", formatted("%.3f&deg;", tilt), "");
  row("Corner noise", formatted("%.3f px", c.rig.sigma_px), "what the fit leaves, 1 sigma an axis");
  row("Rows of the rectified pair", formatted("%.3f px", epipolar_rms(c)),
      "root mean square; matching wants less than 0.3");
  row("Direction of a pixel", formatted("&plusmn; %.3f px", c.direction_sigma_px.most()),
      "1 sigma in 95 % of the left image");
  if (c.halves_expected_m > 0)
    row("Two halves of the views", formatted("%.2f cm apart", 100 * c.halves_apart_m),
        formatted("at the floor; %.2f are expected (1 sigma)", 100 * c.halves_expected_m).c_str());
  row("Bend of the board",
      formatted("%.2f, %.2f mm", 1000 * c.rig.warp_m.x(), 1000 * c.rig.warp_m.y()),
      "its middle against its edges; reckoned with");
  row("Views", formatted("%zu used, %zu rejected", c.views.size(), c.rejected.size()),
      formatted("%zu corners, %d dropped, %d views numbered from the other end", c.residuals.size(),
                c.dropped, c.renumbered)
          .c_str());
  return out + "</table>";
}

}  // namespace

std::string report_page(const StereoCalibration& c, const std::string& title, const Image& pair) {
  static constexpr const char* kClass[] = {"good", "usable", "bad"};
  static constexpr const char* kText[] = {"Good: can be used", "Usable, with what is said below",
                                          "Bad: do not use it"};
  const auto verdict = static_cast<std::size_t>(c.verdict);
  std::string out =
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width'><title>Stereo calibration " +
      escaped(title) + "</title><style>" + kStyle +
      "</style></head><body><h1>Stereo calibration</h1>";
  out += "<p class='sub'>" + escaped(title) + " &middot; " + escaped(c.board.text()) +
         formatted(" &middot; images of %u x %u</p>", c.size.width, c.size.height);
  out += formatted(
      "<div class='verdict %s'>%s<small>A floor at %.1f m: heights sure to %.2f cm (1 "
      "sigma) in 95 %% of the image.</small></div>",
      kClass[verdict], kText[verdict], c.floor_m, 100 * c.height_sigma_m.most());
  if (!c.remarks.empty()) {
    out += "<h2>What would make it better</h2><ul>";
    for (const std::string& remark : c.remarks) out += "<li>" + escaped(remark) + "</li>";
    out += "</ul>";
  }
  out += "<h2>Figures</h2>" + figures(c);
  out += "<h2>Where the board was</h2><div class='two'>";
  for (const bool right : {false, true})
    out += "<figure>" + svg_coverage(c, right) +
           formatted("<figcaption>%s image; shaded: too few corners</figcaption></figure>",
                     right ? "Right" : "Left");
  out += "</div>";
  if (const auto next = next_view(c.coverage))
    out += "<p><b>The next view</b> (dashed): " + next->words + ".</p>";
  out += "<h2>What the fit leaves</h2><div class='two'>";
  for (const bool right : {false, true}) out += "<figure>" + svg_residuals(c, right) + "</figure>";
  out += "</div><h2>How surely</h2><div class='two'><figure>" +
         svg_grid(c.height_sigma_m, c.size, 100) +
         formatted("<figcaption>Height of a floor at %.1f m, 1 sigma [cm]</figcaption></figure>",
                   c.floor_m) +
         "<figure>" + svg_grid(c.direction_sigma_px, c.size, 1) +
         "<figcaption>Direction of a pixel, 1 sigma [px]</figcaption></figure></div>";
  out +=
      "<h2>Views</h2><p class='note'>Root mean square of the corners in the left image (dark), "
      "in the right one (light), and of the rows of the rectified pair (brown) [px].</p>" +
      svg_views(c);
  if (!c.rejected.empty()) {
    out += "<h2>Rejected</h2><table>";
    for (const RejectedView& view : c.rejected)
      out += "<tr><td>" + escaped(view.name) + "</td><td>" + escaped(view.reason) + "</td></tr>";
    out += "</table>";
  }
  out += picture(pair);
  out += "<h2>Numbers</h2><table>" + camera_rows("Left", c.rig.left, c.rig, 0) +
         camera_rows("Right", c.rig.right, c.rig, Eigen::Index(kLensNumbers)) + "</table>";
  return out + "</body></html>\n";
}

}  // namespace crane
