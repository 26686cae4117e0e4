// SPDX-License-Identifier: Apache-2.0
#include "motion/bars.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/threads.hpp"
#include "motion/bar_sweep.hpp"

namespace crane {
namespace {

constexpr double kNearest = 0.45;  ///< of the camera's height above z = 0, as the pair's search
constexpr int kSideBySide = 3;     ///< pieces at one depth
constexpr int kApart = 3;          ///< pieces, from one to the next
constexpr double kAlike_px = 2;    ///< in the farthest view
constexpr double kBehind = 1.02;   ///< of a depth

struct Piece {
  BarBand band;
  std::optional<BarFit> fit;
  int longest = 1;  ///< pieces side by side that it is one of
};

bool alike(const BarFit& a, const BarFit& b) {
  return a.v0 < b.v1 && b.v0 < a.v1 && std::abs(a.inverse_m - b.inverse_m) < kAlike_px * a.step;
}

void join(std::vector<Piece>& pieces, const std::vector<Piece>& beside, int more) {
  for (Piece& piece : pieces)
    for (const Piece& other : beside)
      if (piece.fit && other.fit && alike(*piece.fit, *other.fit))
        piece.longest = std::max(piece.longest, other.longest + more);
}

void follow(BarSweep& sweep, const std::vector<BarFit>& from, std::vector<BarFit>& to, int u0) {
  for (const BarFit& bar : from) {
    if (std::any_of(to.begin(), to.end(), [&](const BarFit& b) { return alike(bar, b); })) continue;
    if (const auto next = sweep.follow(bar, u0)) to.push_back(*next);
  }
}

}  // namespace

BarReport Bars::look(const DepthFrame& f, const PlacedImage& image, const ViewSet& set,
                     std::span<float> depth_m, std::span<std::uint8_t> confidence,
                     std::size_t most) {
  BarReport report;
  const double camera_m = std::abs(f.T_map_rectified.translation().z());
  if (!BarSweep(image, set, kNearest * camera_m).can_tell()) return report;
  const int columns = int(f.width) / kBarPiece;
  std::vector<std::vector<Piece>> pieces(static_cast<std::size_t>(columns));
  int last = -1;
  for (int i = 0; i < columns; ++i) {
    const int column = (next_column_ + i) % columns;
    auto bands = bar_bands(f, depth_m.data(), column * kBarPiece);
    if (report.bands >= most) {
      report.put_off += bands.size();
      if (last < 0) last = column;
      continue;
    }
    for (const BarBand& band : bands) pieces[std::size_t(column)].push_back({band, {}, 1});
    report.bands += bands.size();
  }
  // One that has neighbours on both sides next time.
  next_column_ = last < 0 ? 0 : std::max(0, last - kSideBySide);
  std::atomic<int> next{0};
  on_threads(threads_, [&](int, Meeting&) {
    BarSweep sweep(image, set, kNearest * camera_m);
    for (int column = next++; column < columns; column = next++)
      for (Piece& piece : pieces[std::size_t(column)]) piece.fit = sweep.look(piece.band);
  });
  // How many are alike to the left of each, and then, from the right, of all that it is one of.
  for (int column = 1; column < columns; ++column)
    for (int by = 1; by <= std::min(kApart, column); ++by)
      join(pieces[std::size_t(column)], pieces[std::size_t(column - by)], 1);
  for (int column = columns - 2; column >= 0; --column)
    for (int by = 1; by <= std::min(kApart, columns - 1 - column); ++by)
      join(pieces[std::size_t(column)], pieces[std::size_t(column + by)], 0);
  // What is one of several, and where that goes on.
  std::vector<std::vector<BarFit>> bars(static_cast<std::size_t>(columns));
  for (int column = 0; column < columns; ++column)
    for (const Piece& piece : pieces[std::size_t(column)])
      if (piece.fit && piece.longest >= kSideBySide)
        bars[std::size_t(column)].push_back(*piece.fit);
  BarSweep sweep(image, set, kNearest * camera_m);
  for (int column = 1; column < columns; ++column)
    follow(sweep, bars[std::size_t(column - 1)], bars[std::size_t(column)], column * kBarPiece);
  for (int column = columns - 2; column >= 0; --column)
    follow(sweep, bars[std::size_t(column + 1)], bars[std::size_t(column)], column * kBarPiece);
  const double scale = f.sigma_disparity_px * 255 / (f.f_px * f.baseline_m);
  for (int column = 0; column < columns; ++column)
    for (const BarFit& bar : bars[std::size_t(column)])
      for (int v = bar.v0; v < bar.v1; ++v)
        for (int u = column * kBarPiece; u < (column + 1) * kBarPiece; ++u) {
          const std::size_t i = std::size_t(v) * f.width + std::size_t(u);
          // Not what the pair found at, or before, the bar.
          if (!(std::abs(depth_m[i]) == 0 || depth_m[i] > kBehind / bar.inverse_m)) continue;
          depth_m[i] = -float(1 / bar.inverse_m);
          confidence[i] = static_cast<std::uint8_t>(std::clamp(scale / bar.sigma, 1.0, 255.0));
          ++report.found;
        }
  return report;
}

}  // namespace crane
