// SPDX-License-Identifier: Apache-2.0
#include "client/clearance_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <vector>

#include "client/safe_height.hpp"
#include "client/swept_area.hpp"
#include "client/tile_row.hpp"
#include "client/zone_check.hpp"

namespace crane::client {
namespace {

/// Bits low .. high of 64, cut to the word.
std::uint64_t ones(int low, int high) {
  low = std::max(low, 0);
  high = std::min(high, 63);
  if (low > high) return 0;
  return (~std::uint64_t{0} >> (63 - (high - low))) << low;
}

/// First and last voxel of an interval of heights.
struct Levels {
  int low = 0, high = 0;
};

/// The run of levels that all columns share of the highest free ones: most questions need no other.
class HighestRun {
 public:
  void add(const ColumnTile* tile, int column) {
    if (tile == nullptr || tile->words == 0) {
      all_have_one_ = false;
      return;
    }
    add(tile->top[std::size_t(column)]);
  }
  /// Of a column, or of a group of columns.
  void add(const ColumnTile::Run& run) {
    all_have_one_ &= run.first < run.end;
    first_ = std::max<int>(first_, run.first);
    end_ = std::min<int>(end_, run.end);
  }
  [[nodiscard]] bool holds(const Levels& levels) const {
    return all_have_one_ && first_ <= levels.low && levels.high < end_;
  }
  [[nodiscard]] FreeRun run() const { return {first_, end_}; }

 private:
  int first_ = std::numeric_limits<int>::min(), end_ = std::numeric_limits<int>::max();
  bool all_have_one_ = true;
};

/// What one column says of an interval.
struct ColumnAnswer {
  bool occupied = false, unknown = false;
  int lowest = 0;  ///< voxel that blocks
};

ColumnAnswer look(const ColumnTile* tile, int column, const Levels& levels) {
  ColumnAnswer out;
  if (tile != nullptr && tile->words > 0) {
    const ColumnTile::Run run = tile->top[std::size_t(column)];
    if (run.first <= levels.low && levels.high < run.end) return out;
  }
  out.lowest = levels.low;
  if (tile == nullptr || tile->words == 0 || levels.low < tile->z0 ||
      levels.high >= tile->z0 + 64 * tile->words)
    out.unknown = true;
  if (tile == nullptr) return out;
  bool found = false;
  for (int w = 0; w < tile->words; ++w) {
    const int base = tile->z0 + 64 * w;
    const std::uint64_t wanted = ones(levels.low - base, levels.high - base);
    if (wanted == 0) continue;
    const auto at = static_cast<std::size_t>(w * kTileColumns + column);
    const std::uint64_t occupied = tile->occupied[at] & wanted;
    const std::uint64_t unknown = wanted & ~tile->free[at] & ~tile->occupied[at];
    out.occupied |= occupied != 0;
    out.unknown |= unknown != 0;
    const std::uint64_t blocks = occupied | unknown;
    if (blocks != 0 && !found) {
      found = true;
      out.lowest = base + __builtin_ctzll(blocks);
    }
  }
  return out;
}

}  // namespace

namespace {

/// Rectangles along the axes: most zones are nowhere near most pieces.
bool apart(const SweptPiece& piece, const Zone& zone) {
  const auto beside = [](const auto& a, const auto& b, auto of_a, auto of_b) {
    const auto [a0, a1] = std::minmax_element(
        a.begin(), a.end(), [&](const auto& l, const auto& r) { return of_a(l) < of_a(r); });
    const auto [b0, b1] = std::minmax_element(
        b.begin(), b.end(), [&](const auto& l, const auto& r) { return of_b(l) < of_b(r); });
    return of_a(*a1) < of_b(*b0) || of_b(*b1) < of_a(*a0);
  };
  if (piece.hull.empty() || zone.corners.empty()) return true;
  return beside(
             piece.hull, zone.corners, [](const Corner& c) { return c.x; },
             [](const Zone::Corner& c) { return c.x_m; }) ||
         beside(
             piece.hull, zone.corners, [](const Corner& c) { return c.y; },
             [](const Zone::Corner& c) { return c.y_m; });
}

std::optional<ZoneMeeting> meeting(const SweptPiece& piece, const Zone& zone) {
  if (!zone.active || apart(piece, zone)) return std::nullopt;
  return meet(piece, zone);
}

/// One answer while it is made.
class Check {
 public:
  Check(const ClearanceQuery& query, const ColumnView& map, std::int64_t now_ns)
      : query_(query),
        map_(map),
        now_ns_(now_ns),
        oldest_allowed_(query.max_age_s > 0
                            ? now_ns - static_cast<std::int64_t>(query.max_age_s * 1e9)
                            : std::numeric_limits<std::int64_t>::min()),
        tiles_(map) {}

  Clearance answer() {
    out_.text = query_flaw(query_, map_.voxel_m, map_.zones);
    if (out_.text.empty() && query_.load.above_m < 0 && !(map_.ceiling_m > 0))
      out_.text = "above_m is to the rope's top, and the map does not say where that is";
    if (!out_.text.empty()) {
      out_.reason = Reason::kBadQuery;
      return out_;
    }
    const std::vector<SweptPiece> pieces = sweep(query_, map_.voxel_m, map_.ceiling_m);
    for (const SweptPiece& piece : pieces) {
      decided_ = out_.verdict == Verdict::kBlocked;
      first_along_ = std::numeric_limits<double>::max();
      look_at(piece);
      if (map_.zones != nullptr)
        for (const Zone& zone : *map_.zones) look_at(piece, zone);
    }
    if (out_.verdict != Verdict::kBlocked) out_.verdict = Verdict::kClear;
    out_.unknown_fraction = out_.columns > 0 ? double(unknown_) / double(out_.columns) : 0;
    out_.oldest_age_s = never_seen_ || oldest_ == std::numeric_limits<std::int64_t>::max()
                            ? -1
                            : std::max(0.0, double(now_ns_ - oldest_) * 1e-9);
    if (!other_flaw_) find_safe_height(pieces);
    if (out_.verdict == Verdict::kBlocked) out_.text = in_words();
    return out_;
  }

 private:
  [[nodiscard]] Levels levels_of(double low_m, double high_m) const {
    return {static_cast<int>(std::floor(low_m / map_.voxel_m + kRounding)),
            static_cast<int>(std::ceil(high_m / map_.voxel_m - kRounding)) - 1};
  }

  void look_at(const SweptPiece& piece) {
    const Levels levels = levels_of(piece.low_m, piece.high_m);
    for (const PolygonRow& row : rows_of(piece.hull, map_.voxel_m)) {
      TileRow::Pair here;
      for (int x = row.first; x <= row.last; ++x) {
        if (x == row.first || in_tile(x) == 0) here = tiles_.at(tile_of(x), tile_of(row.row));
        const int column = in_tile(row.row) * kTileEdge + in_tile(x);
        if (column % kGroup == 0 && x + kGroup - 1 <= row.last && whole_group(here, column, levels))
          x += kGroup - 1;
        else
          look_at(piece, levels, here, column, x, row.row);
      }
    }
  }

  /// Eight at once where all of them are free, seen not too long ago and often enough.
  bool whole_group(const TileRow::Pair& here, int column, const Levels& levels) {
    if (here.voxels == nullptr || here.voxels->words == 0 || here.heights == nullptr) return false;
    const auto group = static_cast<std::size_t>(column / kGroup);
    const ColumnTile::Run& run = here.voxels->common[group];
    const std::int64_t seen = here.heights->oldest[group];
    if (run.first > levels.low || levels.high >= run.end || seen == 0 || seen < oldest_allowed_ ||
        (query_.min_views > 1 && here.heights->fewest[group] < query_.min_views))
      return false;
    out_.columns += kGroup;
    highest_.add(run);
    oldest_ = std::min(oldest_, seen);
    return true;
  }

  void look_at(const SweptPiece& piece, Levels levels, const TileRow::Pair& here, int column, int x,
               int y) {
    const double voxel = map_.voxel_m;
    const ColumnHeight* surface =
        here.heights != nullptr ? &here.heights->columns[std::size_t(column)] : nullptr;
    ++out_.columns;
    highest_.add(here.voxels, column);
    // Heights are finer than voxels: a surface that ends below is not in the way.
    if (surface != nullptr && is_known(surface->state) && !surface->lower_bound &&
        surface->height_m + std::max(surface->spread_m, voxel / 2) <= piece.low_m &&
        static_cast<int>(std::floor(surface->height_m / voxel)) == levels.low)
      ++levels.low;
    const ColumnAnswer answer = look(here.voxels, column, levels);
    const std::int64_t seen = surface != nullptr ? surface->last_observed : 0;
    if (seen == 0)
      never_seen_ = true;
    else
      oldest_ = std::min(oldest_, seen);
    const bool old = too_old(seen);
    const bool few = too_few_views(surface);
    other_flaw_ |= old || few;
    if (answer.unknown || old) ++unknown_;
    if (decided_ || (!answer.occupied && !answer.unknown && !old && !few)) return;
    const double px = (x + 0.5) * voxel;
    const double py = (y + 0.5) * voxel;
    const double along =
        (px - piece.start_x) * piece.along_x + (py - piece.start_y) * piece.along_y;
    if (out_.verdict == Verdict::kBlocked && along >= first_along_) return;
    first_along_ = along;
    out_.verdict = Verdict::kBlocked;
    const bool forgotten = surface != nullptr && surface->state == ColumnState::kStale;
    out_.reason = answer.occupied                ? Reason::kObstacle
                  : answer.unknown && !forgotten ? Reason::kUnknown
                  : answer.unknown || old        ? Reason::kStale
                                                 : Reason::kFewViews;
    out_.first_x_m = px;
    out_.first_y_m = py;
    out_.first_z_m = (answer.lowest + 0.5) * voxel;
    above_load_ = answer.lowest * voxel >= piece.load_top_m;
  }

  void look_at(const SweptPiece& piece, const Zone& zone) {
    if (!same_heights(piece, zone)) return;
    const std::optional<ZoneMeeting> met = meeting(piece, zone);
    if (!met) return;
    if (zone.kind == Zone::Kind::kSlowDown) {
      if (!out_.slow_down && out_.zone == 0) out_.zone = zone.id;
      out_.slow_down = true;
      return;
    }
    if (decided_ || (out_.verdict == Verdict::kBlocked && met->along >= first_along_)) return;
    first_along_ = met->along;
    out_.verdict = Verdict::kBlocked;
    out_.reason = Reason::kZone;
    out_.zone = zone.id;
    out_.first_x_m = met->x_m;
    out_.first_y_m = met->y_m;
    out_.first_z_m = std::max(piece.low_m, zone.z_min_m);
    zone_name_ = zone.name;
    above_load_ = zone.z_min_m >= piece.load_top_m;
  }

  void find_safe_height(const std::vector<SweptPiece>& pieces) {
    double asked_m = query_.path[0].z_m;
    bool level = true;
    for (const Pose& p : query_.path) {
      level &= p.z_m == query_.path[0].z_m;
      asked_m = std::max(asked_m, p.z_m);
    }
    std::vector<SweptPiece> flown;
    if (!level) {
      ClearanceQuery flat = query_;
      for (Pose& p : flat.path) p.z_m = asked_m;
      flown = sweep(flat, map_.voxel_m, map_.ceiling_m);
    }
    if (!level && any_flawed(flown)) return;
    const std::vector<SweptPiece>& all = level ? pieces : flown;
    std::vector<const Zone*> no_go;
    if (map_.zones != nullptr)
      for (const Zone& zone : *map_.zones)
        if (zone.kind == Zone::Kind::kNoGo &&
            std::any_of(all.begin(), all.end(), [&zone](const SweptPiece& piece) {
              return meeting(piece, zone).has_value();
            }))
          no_go.push_back(&zone);
    const bool easy = level && highest_.holds(levels_of(pieces[0].low_m, pieces[0].high_m));
    std::optional<HeightInterval> next = next_clear(
        query_, map_, easy && no_go.empty() ? std::vector{highest_.run()} : free_runs(all, map_),
        no_go, asked_m);
    if (level &&
        out_.verdict == Verdict::kClear) {  // by heights, finer than the voxels of the runs
      if (!next || next->low_m > asked_m + map_.voxel_m) next = HeightInterval{asked_m, asked_m};
      next->low_m = std::min(next->low_m, asked_m);
    }
    if (!next) return;
    out_.safe_height_m = std::max(asked_m, next->low_m);
    out_.safe_low_m = next->low_m;
    out_.safe_high_m = next->high_m;
  }

  /// Whether any column is too old, or seen too seldom: that blocks at every height.
  bool any_flawed(const std::vector<SweptPiece>& pieces) {
    if (query_.max_age_s <= 0 && query_.min_views <= 1) return false;
    for (const SweptPiece& piece : pieces)
      for (const PolygonRow& row : rows_of(piece.hull, map_.voxel_m)) {
        const HeightColumns* heights = nullptr;
        for (int x = row.first; x <= row.last; ++x) {
          if (x == row.first || in_tile(x) == 0)
            heights = tiles_.at(tile_of(x), tile_of(row.row)).heights;
          const std::size_t column = std::size_t(in_tile(row.row) * kTileEdge + in_tile(x));
          const ColumnHeight* c = heights != nullptr ? &heights->columns[column] : nullptr;
          if (too_old(c != nullptr ? c->last_observed : 0) || too_few_views(c)) return true;
        }
      }
    return false;
  }

  [[nodiscard]] bool too_old(std::int64_t seen) const {
    return query_.max_age_s > 0 && (seen == 0 || seen < oldest_allowed_);
  }
  [[nodiscard]] bool too_few_views(const ColumnHeight* surface) const {
    return query_.min_views > 1 &&
           (surface == nullptr || !is_known(surface->state) || surface->views < query_.min_views);
  }

  [[nodiscard]] std::string in_words() const {
    const std::string zone = "no-go zone " + std::to_string(out_.zone) +
                             (zone_name_.empty() ? "" : " '" + zone_name_ + "'");
    const char* what = out_.reason == Reason::kObstacle   ? "an obstacle"
                       : out_.reason == Reason::kUnknown  ? "space never seen, so not free,"
                       : out_.reason == Reason::kStale    ? "space not seen for too long"
                       : out_.reason == Reason::kFewViews ? "a surface seen in too few frames"
                                                          : zone.c_str();
    char text[240];
    std::snprintf(text, sizeof text, "%s%s at x %.2f, y %.2f, z %.2f m", what,
                  above_load_ ? " above the load" : "", out_.first_x_m, out_.first_y_m,
                  out_.first_z_m);
    return text;
  }

  const ClearanceQuery& query_;
  const ColumnView& map_;
  std::int64_t now_ns_, oldest_allowed_;
  Clearance out_;
  HighestRun highest_;
  TileRow tiles_;
  std::int64_t oldest_ = std::numeric_limits<std::int64_t>::max();
  std::uint64_t unknown_ = 0;
  bool never_seen_ = false;
  bool other_flaw_ = false;  ///< something blocks at every height: too old, or seen too seldom
  // Of the piece that is looked at.
  bool decided_ = false;  ///< a piece before it blocks
  double first_along_ = 0;
  // Of the first blocking point.
  bool above_load_ = false;
  std::string zone_name_;
};

}  // namespace

Clearance check_clearance(const ClearanceQuery& query, const ColumnView& map, std::int64_t now_ns) {
  return Check(query, map, now_ns).answer();
}

}  // namespace crane::client
