// SPDX-License-Identifier: Apache-2.0
#include "judgement_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace crane {
namespace {

constexpr int kLeft = 60, kTop = 66, kBottom = 40, kRight = 190;
constexpr int kWidth = 1200;  ///< of the map itself, about
const cv::Scalar kInk(30, 30, 30);

struct Kind {
  CellVerdict verdict;
  const char* name;
  cv::Vec3b colour;  // BGR
};
const std::array<Kind, 7> kKinds = {{{CellVerdict::kFound, "found", {60, 170, 40}},
                                     {CellVerdict::kUnknown, "unknown", {150, 150, 150}},
                                     {CellVerdict::kLow, "low", {0, 150, 255}},
                                     {CellVerdict::kCleared, "cleared", {0, 0, 235}},
                                     {CellVerdict::kHollow, "hollow", {20, 20, 120}},
                                     {CellVerdict::kFloor, "floor, mapped", {236, 240, 236}},
                                     {CellVerdict::kBare, "floor, nothing", {190, 190, 200}}}};
const cv::Vec3b kPhantom(255, 0, 255), kNoTruth(255, 255, 255);

/// Cells that anybody saw, with a little around them.
struct Part {
  int column0 = 0, column1 = 0, row0 = 0, row1 = 0;
};

Part seen_part(const HeightMap& h) {
  constexpr int kAround = 20;
  Part part{int(h.columns), 0, int(h.rows), 0};
  for (std::size_t cell = 0; cell < h.height_mm.size(); ++cell) {
    if (!h.seen(cell)) continue;
    const int c = int(cell % h.columns), r = int(cell / h.columns);
    part.column0 = std::min(part.column0, c), part.column1 = std::max(part.column1, c + 1);
    part.row0 = std::min(part.row0, r), part.row1 = std::max(part.row1, r + 1);
  }
  if (part.column1 == 0) return {0, int(h.columns), 0, int(h.rows)};
  return {std::max(0, part.column0 - kAround), std::min(int(h.columns), part.column1 + kAround),
          std::max(0, part.row0 - kAround), std::min(int(h.rows), part.row1 + kAround)};
}

int rank(const Evaluation& e, std::size_t cell) {
  const CellVerdict v = e.cells.verdicts[cell];
  return e.cells.phantom[cell] != 0 && v < CellVerdict::kCleared ? 100 : int(v);
}

cv::Vec3b colour_of(int rank) {
  if (rank == 100) return kPhantom;
  for (const Kind& kind : kKinds)
    if (int(kind.verdict) == rank) return kind.colour;
  return kNoTruth;
}

void write(cv::Mat& image, const std::string& text, cv::Point at, double size = 0.45) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kInk, 1, cv::LINE_AA);
}

}  // namespace

Result<void> draw_judgement(const std::string& png_path, const TrueSolids& truth,
                            const Evaluation& e, const std::string& title) {
  const HeightMap& h = truth.heights;
  // A pixel is some cells: it shows the worst of them, so that no thin thing is lost.
  const Part part = seen_part(h);
  const int columns = part.column1 - part.column0;
  const int step = std::max(1, columns / kWidth);
  const int width = columns / step, height = (part.row1 - part.row0) / step;
  const int scale =
      std::max(1, kWidth / 2 / std::max(1, width));  // of a small map, cells are squares
  const double x0_m = h.origin_x_m + part.column0 * h.cell_m;
  const double y0_m = h.origin_y_m + part.row0 * h.cell_m;
  cv::Mat cells(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int worst = 0;
      for (int q = 0; q < step; ++q)
        for (int p = 0; p < step; ++p)
          worst = std::max(worst, rank(e, std::size_t(part.row0 + y * step + q) * h.columns +
                                              std::size_t(part.column0 + x * step + p)));
      cells.at<cv::Vec3b>(height - 1 - y, x) = colour_of(worst);
    }
  const int wide = width * scale, high = height * scale;
  cv::Mat image(high + kTop + kBottom, std::max(wide, kWidth / 2) + kLeft + kRight, CV_8UC3,
                cv::Scalar::all(255));
  cv::resize(cells, image(cv::Rect(kLeft, kTop, wide, high)), cv::Size(wide, high), 0, 0,
             cv::INTER_NEAREST);
  const auto pixel = [&](double x_m, double y_m) {
    return cv::Point(kLeft + int((x_m - x0_m) / h.cell_m / step * scale),
                     kTop + high - 1 - int((y_m - y0_m) / h.cell_m / step * scale));
  };
  if (e.cells.all.cleared > 0)
    cv::circle(image, pixel(e.cells.worst_x_m, e.cells.worst_y_m), 18, {0, 0, 235}, 2, cv::LINE_AA);
  if (e.clearance.wrong_clear > 0)
    cv::circle(image, pixel(e.clearance.first_x_m, e.clearance.first_y_m), 24, {200, 0, 0}, 2,
               cv::LINE_AA);
  cv::rectangle(image, {kLeft - 1, kTop - 1, wide + 2, high + 2}, kInk);
  const double metre = scale / (h.cell_m * step);
  const double tick = metre > 40 ? 1 : metre > 12 ? 2 : 10;
  for (double x = std::ceil(x0_m / tick) * tick; x < x0_m + wide / metre; x += tick)
    write(image, cv::format("%.0f", x + 0.0), {pixel(x, y0_m).x - 4, kTop + high + 18});
  for (double y = std::ceil(y0_m / tick) * tick; y < y0_m + high / metre; y += tick)
    write(image, cv::format("%.0f", y + 0.0), {18, pixel(x0_m, y).y + 5});
  write(image, "x [m]", {kLeft + wide / 2, kTop + high + 34});
  write(image, "y [m]", {8, kTop - 6});
  write(image, title, {kLeft, 22}, 0.55);
  write(
      image,
      cv::format("coverage %.4f  unsafe %.4f  phantom %.5f  low %.4f  cleared %.4f  hollow %.4f  "
                 "wrong CLEAR %zu of %zu",
                 e.columns.coverage, e.columns.unsafe, e.columns.phantom,
                 e.cells.all.share(e.cells.all.low), e.cells.all.share(e.cells.all.cleared),
                 e.cells.all.share(e.cells.all.hollow), e.clearance.wrong_clear, e.clearance.clear),
      {kLeft, 57});
  int row = kTop + 14;
  const auto legend = [&](const std::string& name, const cv::Vec3b& colour) {
    cv::rectangle(image, {kLeft + wide + 14, row - 11, 18, 14}, cv::Scalar(colour), cv::FILLED);
    cv::rectangle(image, {kLeft + wide + 14, row - 11, 18, 14}, kInk);
    write(image, name, {kLeft + wide + 40, row});
    row += 24;
  };
  for (const Kind& kind : kKinds) legend(kind.name, kind.colour);
  legend("phantom", kPhantom);
  write(image, "ring red: cleared", {kLeft + wide + 14, row});
  write(image, "ring blue: wrong CLEAR", {kLeft + wide + 14, row + 20});
  bool written = false;
  try {
    written = cv::imwrite(png_path, image);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (written) return {};
  return Error{ErrorCode::kResource, png_path, "cannot be written",
               "check permissions and free space"};
}

}  // namespace crane
