// SPDX-License-Identifier: Apache-2.0
#include "motion/bars.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "base/threads.hpp"
#include "motion/bar_sweep.hpp"

namespace crane {
namespace {

constexpr double kNearest = 0.45;  ///< of the camera's height above z = 0, as the pair's search
constexpr int kFewestPieces = 3;   ///< of a bar
constexpr int kApart = 3;          ///< columns, from one piece to the next
constexpr double kAlike_px = 2;    ///< in the farthest view
constexpr float kBehind = 1.02F;   ///< of a depth
/// The frame's sigma of a disparity at full confidence.
constexpr double kFull = 255;

struct Piece {
  BarBand band;
  std::optional<BarFit> fit;
  int of = 1;  ///< pieces in line that it is one of
};
using Columns = std::vector<std::vector<Piece>>;

bool in_line(const Piece& a, const Piece& b) {
  return a.band.v0 <= b.band.v1 && b.band.v0 <= a.band.v1;
}

bool alike(const BarFit& a, const BarFit& b) {
  return a.v0 < b.v1 && b.v0 < a.v1 && std::abs(a.inverse_m - b.inverse_m) < kAlike_px * a.step;
}

bool one_bar(const Piece& a, const Piece& b) {
  return a.fit && b.fit && alike(*a.fit, *b.fit);
}

/// How many pieces each is one of: first those to the left of each, then the most of these.
template <class Same>
void count_in_line(Columns& columns, Same same) {
  const int n = int(columns.size());
  const auto join = [&](int column, int beside, int more) {
    for (Piece& piece : columns[std::size_t(column)])
      for (const Piece& other : columns[std::size_t(beside)])
        if (same(piece, other)) piece.of = std::max(piece.of, other.of + more);
  };
  for (auto& column : columns)
    for (Piece& piece : column) piece.of = 1;
  for (int column = 1; column < n; ++column)
    for (int by = 1; by <= std::min(kApart, column); ++by) join(column, column - by, 1);
  for (int column = n - 2; column >= 0; --column)
    for (int by = 1; by <= std::min(kApart, n - 1 - column); ++by) join(column, column + by, 0);
}

bool goes_on(const BarFit& bar, const std::vector<BarFit>& beside) {
  return std::any_of(beside.begin(), beside.end(), [&](const BarFit& b) { return alike(bar, b); });
}

/// The bars of one column of pieces that go on in the next.
void follow(BarSweep& sweep, const std::vector<BarFit>& from, std::vector<BarFit>& to, int u0) {
  for (const BarFit& bar : from) {
    if (goes_on(bar, to)) continue;
    if (const auto next = sweep.follow(bar, u0)) to.push_back(*next);
  }
}

}  // namespace

BarReport Bars::look(const DepthFrame& f, const PlacedImage& image, const ViewSet& set,
                     std::span<float> depth_m, std::span<std::uint8_t> confidence,
                     std::size_t most) {
  BarReport report;
  const double nearest_m = kNearest * std::abs(f.T_map_rectified.translation().z());
  BarSweep sweep(image, set, nearest_m);
  if (!sweep.can_tell()) return report;
  const int columns = int(f.width) / kBarPiece;
  Columns pieces(static_cast<std::size_t>(columns));
  for (int column = 0; column < columns; ++column)
    for (const BarBand& band : bar_bands(f, depth_m.data(), column * kBarPiece))
      pieces[std::size_t(column)].push_back({band, {}, 1});
  count_in_line(pieces, in_line);
  int put_off = -1;  // the first column of these
  for (int i = 0; i < columns; ++i) {
    const int column = (next_column_ + i) % columns;
    auto& here = pieces[std::size_t(column)];
    std::erase_if(here, [](const Piece& p) { return p.of < kFewestPieces; });
    if (report.bands >= most && !here.empty()) {
      report.put_off += here.size();
      here.clear();
      if (put_off < 0) put_off = column;
    }
    report.bands += here.size();
  }
  next_column_ = std::max(0, put_off - kApart);
  std::atomic<int> next{0};
  on_threads(threads_, [&](int, Meeting&) {
    BarSweep own(image, set, nearest_m);
    for (int column = next++; column < columns; column = next++)
      for (Piece& piece : pieces[std::size_t(column)]) piece.fit = own.look(piece.band);
  });
  count_in_line(pieces, one_bar);
  std::vector<std::vector<BarFit>> bars(static_cast<std::size_t>(columns));
  for (int column = 0; column < columns; ++column)
    for (const Piece& piece : pieces[std::size_t(column)])
      if (piece.fit && piece.of >= kFewestPieces) bars[std::size_t(column)].push_back(*piece.fit);
  for (int column = 1; column < columns; ++column)
    follow(sweep, bars[std::size_t(column - 1)], bars[std::size_t(column)], column * kBarPiece);
  for (int column = columns - 2; column >= 0; --column)
    follow(sweep, bars[std::size_t(column + 1)], bars[std::size_t(column)], column * kBarPiece);
  const double scale = f.sigma_disparity_px * kFull / (f.f_px * f.baseline_m);
  for (int column = 0; column < columns; ++column)
    for (const BarFit& bar : bars[std::size_t(column)]) {
      // Amid a bar what the pair found behind it is wrong; at its ends it may be right.
      const bool amid = column > 0 && column + 1 < columns &&
                        goes_on(bar, bars[std::size_t(column - 1)]) &&
                        goes_on(bar, bars[std::size_t(column + 1)]);
      const auto depth = static_cast<float>(1 / bar.inverse_m);
      for (int v = bar.v0; v < bar.v1; ++v)
        for (int u = column * kBarPiece; u < (column + 1) * kBarPiece; ++u) {
          const std::size_t i = std::size_t(v) * f.width + std::size_t(u);
          if (depth_m[i] != 0 && !(amid && std::abs(depth_m[i]) > kBehind * depth)) continue;
          depth_m[i] = -depth;
          confidence[i] = static_cast<std::uint8_t>(std::clamp(scale / bar.sigma, 1.0, kFull));
          ++report.found;
        }
    }
  return report;
}

}  // namespace crane
