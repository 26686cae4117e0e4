// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_stereo.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/expects.hpp"

namespace crane {
namespace {

/// Of the camera's height above z = 0, as the pair's search.
constexpr double kNearest = 0.45, kFarthest = 1.15;
constexpr std::size_t kMostViews = 6;
/// A cell with so many pixels without a match frees nothing, see FreeDepth.
constexpr double kUnmatched = 0.06;
/// A plain stretch between two textured places at one depth, at most so long, is at that depth.
constexpr int kPlainReach_px = 64;
constexpr float kNearer = 0.985F;  ///< of a depth: something else, before it
constexpr double kHidden =
    0.9;  ///< of the camera's height: what lies on the floor, and lower things
constexpr double kOneDepth = 3;  ///< sigmas
/// Of the time between frames a tenth at most: cells looked at a second, on two threads.
constexpr double kCellsPerSecond = 600;
constexpr double kPatternsPerSecond = 2'500;
constexpr double kBandsPerSecond = 1'500;
constexpr double kSharpPerSecond = 20'000;
constexpr double kLongestPause_s = 3;
constexpr double kStands_m = 0.01;
/// The pair's depths are sharpened where the crane went so many times the pair's baseline.
constexpr double kWorthwhile = 3;
constexpr double kUncertain_m = 0.02;  ///< and its best standard deviation at the floor is larger
constexpr int kSharpViews = 3, kSharpAttempts = 2;
constexpr double kMatched = 0.9;    ///< share of a cell's pixels
constexpr double kPairSigma = 1.5;  ///< what its pixels have in common is as uncertain as they are
constexpr double kBent = 2.5;       ///< sigmas that a cell's pixels may deviate from a plane
/// The frame's sigma_disparity is divided by this, so that confidence can say what got better.
constexpr int kFiner = 4;
constexpr int kFewestBetween = 3;  ///< views that bear out both cells beside one
/// What is done with a cell, and that it got a depth.
enum : std::uint8_t { kNothing, kSweep, kTold, kBetween, kFound };

/// The nearest surface that the pair found in a cell and half a cell around [m].
float nearest_around(const DepthFrame& f, int u0, int v0) {
  float nearest = std::numeric_limits<float>::infinity();
  constexpr int kAround = kCellEdge / 2;
  for (int y = std::max(0, v0 - kAround); y < std::min(int(f.height), v0 + kCellEdge + kAround);
       ++y)
    for (int x = std::max(0, u0 - kAround); x < std::min(int(f.width), u0 + kCellEdge + kAround);
         ++x)
      if (const float z = std::abs(f.depth_m[std::size_t(y) * f.width + std::size_t(x)]); z > 0)
        nearest = std::min(nearest, z);
  return nearest;
}

/// Plain pixels between two textured ones of the same depth along a line are as good as these.
/// `at(i)`: index of the i-th pixel of the line.
template <class At>
void join_line(int length, At at, const std::vector<float>& inverse,
               const std::vector<float>& sigma, const std::vector<Borne>& borne,
               std::vector<std::uint8_t>& joined) {
  int last = -1;  // textured
  for (int i = 0; i < length; ++i) {
    const std::size_t here = at(i);
    if (borne[here] == Borne::kPlain) continue;
    if (borne[here] != Borne::kTextured) {
      last = -1;
      continue;
    }
    if (last >= 0 && i - last > 1 && i - last <= kPlainReach_px) {
      const std::size_t before = at(last);
      const auto same = [&](std::size_t a, std::size_t b) {
        return std::abs(inverse[a] - inverse[b]) <= float(kOneDepth) * std::max(sigma[a], sigma[b]);
      };
      for (int k = last + 1; k < i; ++k)
        if (same(at(k), before) && same(at(k), here)) joined[at(k)] = 1;
    }
    last = i;
  }
}

/// By a few of the views; if they do not agree, as where one sees what hides it, by others.
std::optional<CellFit> sharpened(CellProof& proof, int u0, int v0, double inverse_m, double sigma) {
  std::uint32_t left = proof.seen_by(u0, v0, inverse_m);
  for (int attempt = 0; attempt < kSharpAttempts && left != 0; ++attempt) {
    std::uint32_t views = 0;
    for (int i = 0; i < kSharpViews && left != 0; ++i) {
      views |= left & -left;
      left &= left - 1;
    }
    if (const auto fit = proof.sharpen(u0, v0, inverse_m, sigma, views)) return fit;
  }
  return std::nullopt;
}

}  // namespace

MotionReport MotionStereo::improve(DepthFrame& frame, TimeNs exposure, std::span<float> depth_m,
                                   std::span<std::uint8_t> confidence,
                                   std::span<const float> ambiguous_m) {
  MotionReport report;
  const std::size_t pixels = std::size_t(frame.width) * frame.height;
  expects(depth_m.size() == pixels && confidence.size() == pixels, "pixels fit the frame");
  if (frame.colour == nullptr) return report;
  const double camera_m = std::abs(frame.T_map_rectified.translation().z());
  const double pair_m = camera_m * camera_m / (frame.f_px * frame.baseline_m);
  const bool uncertain = pair_m * frame.sigma_disparity_px > kUncertain_m;
  // Standing still nothing new is seen; but what the pair blurs is sharpened on.
  const Eigen::Vector3d place = frame.T_map_rectified.translation();
  const bool stands = (place - last_place_).norm() < kStands_m && exposure > last_;
  if (stands && !uncertain && double(exposure - last_) < kLongestPause_s * 1e9) return report;
  last_place_ = place;
  PlacedImage image = placed_image(frame, exposure, threads_);
  const ViewSet set = choose_views(frame, image, keys_, kMostViews, threads_);
  report.views = set.views.size();
  report.misplaced = set.misplaced;
  if (set.proves_rest) {  // else it could be something that moves as steadily
    const double pause_s = std::clamp(double(exposure - last_) * 1e-9, 0.0, kLongestPause_s);
    patterns_.clear();
    if (!ambiguous_m.empty())
      report.patterns =
          patterns_.look(frame, image, set, ambiguous_m, std::size_t(kPatternsPerSecond * pause_s));
    look_at_cells(frame, image, set, std::size_t(kCellsPerSecond * pause_s), report);
    fill(frame, depth_m, confidence, report);
    report.bars =
        bars_.look(frame, image, set, depth_m, confidence, std::size_t(kBandsPerSecond * pause_s));
  }
  if (uncertain && set.longest_m > kWorthwhile * frame.baseline_m)
    sharpen(frame, image, set, depth_m, confidence, report);
  last_ = exposure;
  keys_.add(std::move(image));
  return report;
}

void MotionStereo::look_at_cells(const DepthFrame& f, const PlacedImage& image, const ViewSet& set,
                                 std::size_t most, MotionReport& report) {
  const int width = int(f.width), height = int(f.height);
  columns_ = width / kCellEdge;
  rows_ = height / kCellEdge;
  const double camera_m = std::abs(f.T_map_rectified.translation().z());
  int last = 0;
  const auto cells = std::size_t(columns_) * std::size_t(rows_);
  wanted_.assign(cells, 0);
  // What the right camera cannot see is no place without a match.
  const double hidden_px = f.f_px * f.baseline_m / (kHidden * camera_m);
  const auto both_see = [&](int u) { return u >= hidden_px; };
  // Whole rows of cells, each frame the next ones: a cell frees nothing without those around it.
  for (int i = 0; i < rows_; ++i) {
    const int row = (next_row_ + i) % rows_;
    for (int column = 0; column < columns_; ++column) {
      int unmatched = 0;
      for (int y = row * kCellEdge; y < (row + 1) * kCellEdge; ++y) {
        const float* depth = f.depth_m + std::size_t(y) * f.width + std::size_t(column) * kCellEdge;
        unmatched += int(std::count(depth, depth + kCellEdge, 0.0F));
      }
      if (unmatched < kUnmatched * kCellEdge * kCellEdge || !both_see(column * kCellEdge)) continue;
      std::uint8_t& wanted = wanted_[std::size_t(row * columns_ + column)];
      if (patterns_.at(row, column)) {
        wanted = kTold;
        continue;
      }
      if (const auto fit = patterns_.between(row, column); fit && fit->count >= kFewestBetween) {
        wanted = kBetween;
        continue;
      }
      if (report.cells >= most) {
        ++report.put_off;
        continue;
      }
      wanted = kSweep;
      if (++report.cells == most) last = row;
    }
  }
  next_row_ = report.put_off > 0 ? last : 0;
  const std::size_t pixels = std::size_t(f.width) * f.height;
  if (borne_.size() != pixels) {
    inverse_.assign(pixels, 0);
    sigma_.assign(pixels, 0);
    borne_.assign(pixels, Borne::kNot);
  }
  if (report.cells == 0) return;
  const Hypotheses hypotheses =
      hypotheses_for(image, set, kNearest * camera_m, kFarthest * camera_m);
  std::atomic<int> next{0};
  on_threads(threads_, [&](int, Meeting&) {
    CellSweep sweep(image, set, hypotheses);
    CellProof proof(image, set);
    std::array<Borne, kCellEdge * kCellEdge> borne;
    for (int row = next++; row < rows_; row = next++)
      for (int column = 0; column < columns_; ++column) {
        const int u0 = column * kCellEdge, v0 = row * kCellEdge;
        const auto cell = std::size_t(row * columns_ + column);
        const std::uint8_t way = wanted_[cell];
        std::optional<CellFit> fit;
        if (way == kTold)
          fit = patterns_.at(row, column);
        else if (way == kBetween)
          fit = patterns_.between(row, column);
        else if (way == kSweep)
          fit = proof.decide(u0, v0, sweep.look(u0 + kCellEdge / 2, v0 + kCellEdge / 2));
        // Beside something nearer it may be that, or what it hides from some of the views.
        if (!fit || nearest_around(f, u0, v0) < kNearer / float(fit->inverse_m)) continue;
        wanted_[cell] = kFound;
        proof.look(u0, v0, *fit, borne);
        for (int y = 0; y < kCellEdge; ++y)
          for (int x = 0; x < kCellEdge; ++x) {
            const std::size_t at = std::size_t(v0 + y) * f.width + std::size_t(u0 + x);
            borne_[at] = borne[std::size_t(y * kCellEdge + x)];
            // What has no depth of its own is no end of a stretch.
            if (way == kBetween && borne_[at] == Borne::kTextured) borne_[at] = Borne::kPlain;
            inverse_[at] = float(fit->inverse_m);
            sigma_[at] = float(fit->sigma);
          }
      }
  });
}

void MotionStereo::fill(const DepthFrame& f, std::span<float> depth_m,
                        std::span<std::uint8_t> confidence, MotionReport& report) {
  // All that has a depth lies in these cells.
  int r0 = rows_, r1 = 0, c0 = columns_, c1 = 0;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      if (wanted_[std::size_t(row * columns_ + column)] != kFound) continue;
      r0 = std::min(r0, row), r1 = row + 1;
      c0 = std::min(c0, column), c1 = std::max(c1, column + 1);
    }
  if (r0 >= r1) return;
  const int x0 = c0 * kCellEdge, x1 = c1 * kCellEdge, y0 = r0 * kCellEdge, y1 = r1 * kCellEdge;
  const auto at = [&](int x, int y) { return std::size_t(y) * f.width + std::size_t(x); };
  std::vector<std::uint8_t> joined(depth_m.size());
  for (int y = y0; y < y1; ++y)
    join_line(
        x1 - x0, [&](int i) { return at(x0 + i, y); }, inverse_, sigma_, borne_, joined);
  for (int x = x0; x < x1; ++x)
    join_line(
        y1 - y0, [&](int i) { return at(x, y0 + i); }, inverse_, sigma_, borne_, joined);
  // sigma_disparity * 255 / confidence is the deviation of f b / z.
  const double scale = f.sigma_disparity_px * 255 / (f.f_px * f.baseline_m);
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const std::size_t i = at(x, y);
      const bool proven = borne_[i] == Borne::kTextured || joined[i] != 0;
      borne_[i] = Borne::kNot;  // for the next frame
      if (depth_m[i] != 0 || !proven) continue;
      depth_m[i] = 1 / inverse_[i];
      confidence[i] = static_cast<std::uint8_t>(std::clamp(scale / double(sigma_[i]), 1.0, 255.0));
      ++report.proven;
    }
}

void MotionStereo::sharpen(DepthFrame& f, const PlacedImage& image, const ViewSet& set,
                           std::span<float> depth_m, std::span<std::uint8_t> confidence,
                           MotionReport& report) {
  const int columns = int(f.width) / kCellEdge, rows = int(f.height) / kCellEdge;
  const double pause_s = std::clamp(double(image.exposure - last_) * 1e-9, 0.0, kLongestPause_s);
  const int most = std::clamp(int(kSharpPerSecond * pause_s / columns), 1, rows);
  const double scale = 255 * f.sigma_disparity_px / (f.f_px * f.baseline_m);
  std::array<double, 256> sigma_of{};  // a pixel's, by its confidence
  for (int c = 0; c < 256; ++c) sigma_of[std::size_t(c)] = scale / std::max(1, c);
  std::vector<std::uint8_t> sharp(depth_m.size());
  std::atomic<int> next{0};
  std::atomic<std::size_t> refined{0};
  on_threads(threads_, [&](int, Meeting&) {
    CellProof proof(image, set);
    for (int turn = next++; turn < most; turn = next++) {
      const int row = (next_sharp_ + turn) % rows;
      for (int column = 0; column < columns; ++column) {
        const std::size_t first =
            std::size_t(row) * kCellEdge * f.width + std::size_t(column) * kCellEdge;
        // A plane through the cell's inverse depths; offsets from its middle are independent.
        double n = 0, sw = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sxw = 0, syw = 0, sww = 0;
        double deviations = 0;
        for (int y = 0; y < kCellEdge; ++y)
          for (int x = 0; x < kCellEdge; ++x) {
            const std::size_t i = first + std::size_t(y) * f.width + std::size_t(x);
            const double z = std::abs(double(depth_m[i]));
            if (!(z > 0)) continue;
            const double w = 1 / z;
            n += 1, sw += w, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
            sxw += x * w, syw += y * w, sww += w * w;
            deviations += sigma_of[confidence[i]];
          }
        if (n < kMatched * kCellEdge * kCellEdge) continue;
        const double mx = sx / n, my = sy / n, mw = sw / n, sigma = deviations / n;
        const double xx = sxx / n - mx * mx, xy = sxy / n - mx * my, yy = syy / n - my * my;
        const double xw = sxw / n - mx * mw, yw = syw / n - my * mw, ww = sww / n - mw * mw;
        const double det = xx * yy - xy * xy;
        if (!(det > 0)) continue;
        const double ax = (xw * yy - yw * xy) / det, ay = (yw * xx - xw * xy) / det;
        if (std::sqrt(std::max(0.0, ww - ax * xw - ay * yw)) > kBent * sigma) continue;
        const double middle = (kCellEdge - 1) / 2.0;
        const double before = mw + ax * (middle - mx) + ay * (middle - my);
        const int u0 = column * kCellEdge, v0 = row * kCellEdge;
        const auto fit = sharpened(proof, u0, v0, before, kPairSigma * sigma);
        if (!fit || fit->sigma > 0.5 * sigma) continue;
        const double finer = std::clamp(scale / kFiner / fit->sigma, 1.0, 255.0);
        for (int y = 0; y < kCellEdge; ++y)
          for (int x = 0; x < kCellEdge; ++x) {
            const std::size_t i = first + std::size_t(y) * f.width + std::size_t(x);
            if (!(std::abs(depth_m[i]) > 0)) continue;
            const double w = fit->inverse_m + ax * (x - middle) + ay * (y - middle);
            if (!(w > 0) || std::abs(1 / std::abs(double(depth_m[i])) - w) > 5 * sigma) continue;
            depth_m[i] = std::copysign(float(1 / w), depth_m[i]);
            confidence[i] = static_cast<std::uint8_t>(finer);
            sharp[i] = 1;
            ++refined;
          }
      }
    }
  });
  next_sharp_ = (next_sharp_ + most) % rows;
  report.refined = refined;
  if (refined == 0) return;
  f.sigma_disparity_px /= kFiner;
  for (std::size_t i = 0; i < confidence.size(); ++i)
    if (sharp[i] == 0 && confidence[i] > 0)
      confidence[i] = static_cast<std::uint8_t>(std::max(1, confidence[i] / kFiner));
}

}  // namespace crane
