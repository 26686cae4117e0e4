#include "client/clearance_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "client/swept_area.hpp"
#include "client/zone_check.hpp"

namespace crane::client {
namespace {

constexpr double kFarthest = 1e5;  ///< [m] of any coordinate
constexpr std::size_t kMaxPoses = 256;
constexpr double kMaxColumns = 4e6;  ///< of the box around a piece

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

/// Which levels are not free in any of the columns: for the safe height.
class BlockedLevels {
 public:
  /// Adds columns first .. first + count - 1 of a tile.
  void add(const ColumnTile* tile, int first, int count) {
    if (tile == nullptr || tile->words == 0) {
      nothing_known_ = true;
      return;
    }
    Sum& sum = sums_[{tile->z0, tile->words}];
    sum.occupied.resize(std::size_t(tile->words));
    sum.blocked.resize(std::size_t(tile->words));
    for (int w = 0; w < tile->words; ++w) {
      const std::uint64_t* occupied = tile->occupied.data() + w * kTileColumns + first;
      const std::uint64_t* free = tile->free.data() + w * kTileColumns + first;
      std::uint64_t any_occupied = 0;
      std::uint64_t all_free = ~std::uint64_t{0};
      for (int i = 0; i < count; ++i) {
        any_occupied |= occupied[i];
        all_free &= free[i];
      }
      sum.occupied[std::size_t(w)] |= any_occupied;
      sum.blocked[std::size_t(w)] |= ~all_free;
    }
  }
  /// No voxel of an interval may be used: a zone.
  void forbid(const Levels& levels) { forbidden_.push_back(levels); }
  /// Lowest voxel from which `count` are free in all columns, with nothing occupied above it.
  [[nodiscard]] std::optional<int> lowest_free(int count) const {
    if (nothing_known_ || sums_.empty()) return std::nullopt;
    int from = std::numeric_limits<int>::min();  // first level that all tiles hold
    int to = std::numeric_limits<int>::max();
    for (const auto& [levels, sum] : sums_) {
      from = std::max(from, levels.first);
      to = std::min(to, levels.first + 64 * levels.second - 1);
      for (int z = levels.first; z < levels.first + 64 * levels.second; ++z)
        if (bit(sum.occupied, z - levels.first)) from = std::max(from, z + 1);
    }
    int run = 0;
    for (int z = from; z <= to; ++z) {
      const bool blocked = std::any_of(sums_.begin(), sums_.end(), [z](const auto& s) {
        return bit(s.second.blocked, z - s.first.first);
      });
      const bool forbidden = std::any_of(forbidden_.begin(), forbidden_.end(),
                                         [z](const auto& f) { return f.low <= z && z <= f.high; });
      run = blocked || forbidden ? 0 : run + 1;
      if (run == count) return z - count + 1;
    }
    return std::nullopt;
  }

 private:
  /// Of all columns whose tiles hold the same levels.
  struct Sum {
    std::vector<std::uint64_t> occupied, blocked;
  };
  static bool bit(const std::vector<std::uint64_t>& bits, int at) {
    return (bits[std::size_t(at / 64)] >> (at % 64) & 1U) != 0;
  }
  std::map<std::pair<int, int>, Sum> sums_;  ///< by first level and words
  std::vector<Levels> forbidden_;
  bool nothing_known_ = false;
};

/// The safe height where it is easy: above the highest occupied voxel of all columns everything is
/// free up to some level.
class HighestRun {
 public:
  void add(const ColumnTile* tile, int column) {
    if (tile == nullptr || tile->words == 0) {
      easy_ = false;
      return;
    }
    const ColumnTile::Run run = tile->top[std::size_t(column)];
    easy_ &= run.first < run.end;
    end_ = std::min<int>(end_, run.end);
    if (run.first <= first_) return;
    first_ = run.first;
    ends_at_obstacle_ = tile->is_occupied(column, first_ - 1);
  }
  /// A group of columns that all have a run.
  void add(const ColumnTile::CommonRun& run) {
    end_ = std::min<int>(end_, run.end);
    if (run.first <= first_) return;
    first_ = run.first;
    ends_at_obstacle_ = run.on_obstacle;
  }
  /// Whether lowest_free() is what BlockedLevels would say.
  [[nodiscard]] bool easy(int count) const {
    return easy_ && ends_at_obstacle_ && first_ + count <= end_;
  }
  [[nodiscard]] int lowest_free() const { return first_; }

 private:
  int first_ = std::numeric_limits<int>::min(), end_ = std::numeric_limits<int>::max();
  bool easy_ = true, ends_at_obstacle_ = false;
};

/// The tiles under one row of tiles, looked up once.
class TileRow {
 public:
  explicit TileRow(const ColumnView& map) : map_(map) {}
  struct Pair {
    const ColumnTile* voxels = nullptr;
    const HeightColumns* heights = nullptr;
  };
  const Pair& at(int tile_x, int tile_y) {
    if (tile_y != y_) {
      y_ = tile_y;
      x0_ = tile_x;
      tiles_.clear();
    }
    if (tile_x < x0_) {
      tiles_.insert(tiles_.begin(), std::size_t(x0_ - tile_x), std::nullopt);
      x0_ = tile_x;
    }
    const auto i = std::size_t(tile_x - x0_);
    if (i >= tiles_.size()) tiles_.resize(i + 1);
    if (!tiles_[i]) tiles_[i] = Pair{map_.voxels({tile_x, tile_y}), map_.heights({tile_x, tile_y})};
    return *tiles_[i];
  }

 private:
  const ColumnView& map_;
  int y_ = std::numeric_limits<int>::min(), x0_ = 0;
  std::vector<std::optional<Pair>> tiles_;
};

/// The safe height where things of which nothing is known lie above others, or zones are met: level
/// by level.
std::optional<int> lowest_free(const std::vector<SweptPiece>& pieces, double voxel, TileRow& tiles,
                               const std::vector<Levels>& zones, int count) {
  BlockedLevels levels;
  for (const Levels& zone : zones) levels.forbid(zone);
  for (const SweptPiece& piece : pieces)
    for (const PolygonRow& row : rows_of(piece.hull, voxel))
      for (int x = row.first; x <= row.last; x += kTileEdge - in_tile(x))
        levels.add(tiles.at(tile_of(x), tile_of(row.row)).voxels,
                   in_tile(row.row) * kTileEdge + in_tile(x),
                   std::min(row.last - x, kTileEdge - 1 - in_tile(x)) + 1);
  return levels.lowest_free(count);
}

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

std::string query_flaw(const ClearanceQuery& q, double voxel_m) {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  if (q.path.empty()) return "the path has no pose";
  if (q.path.size() > kMaxPoses) return "the path has more than 256 poses";
  for (const Pose& p : q.path)
    if (!within(p.x_m, -kFarthest, kFarthest) || !within(p.y_m, -kFarthest, kFarthest) ||
        !within(p.z_m, -100, 1000) || !within(p.yaw_rad, -100, 100))
      return "a pose is not finite or out of range";
  const Load& l = q.load;
  if (!within(l.size_x_m, 0, 100) || !within(l.size_y_m, 0, 100) || !within(l.size_z_m, 0, 100) ||
      !within(l.above_m, 0, 100))
    return "the size of the load is not within 0 .. 100 m";
  const Margins& m = q.margins;
  if (!within(m.horizontal_m, 0, 100) || !within(m.vertical_m, 0, 100) ||
      !within(m.sway_m, 0, 100) || !within(m.braking_m, 0, 100))
    return "a margin is not within 0 .. 100 m";
  if (!within(q.max_age_s, 0, 1e9)) return "max_age_s is not within 0 .. 1e9 s";
  const double reach = l.size_x_m + l.size_y_m + 4 * (m.horizontal_m + m.sway_m) + m.braking_m;
  double columns = 0;
  for (std::size_t i = 0; i + 1 < q.path.size(); ++i)
    columns += (std::abs(q.path[i + 1].x_m - q.path[i].x_m) + reach) *
               (std::abs(q.path[i + 1].y_m - q.path[i].y_m) + reach) / (voxel_m * voxel_m);
  if (columns > kMaxColumns) return "the path sweeps more than four million columns: split it";
  return {};
}

Clearance check_clearance(const ClearanceQuery& query, const ColumnView& map, std::int64_t now_ns) {
  Clearance out;
  out.text = query_flaw(query, map.voxel_m);
  if (!out.text.empty()) {
    out.reason = Reason::kBadQuery;
    return out;
  }
  const double voxel = map.voxel_m;
  const std::vector<SweptPiece> pieces = sweep(query, voxel);
  const auto levels_of = [voxel](double low_m, double high_m) {
    return Levels{static_cast<int>(std::floor(low_m / voxel)),
                  static_cast<int>(std::ceil(high_m / voxel)) - 1};
  };
  HighestRun highest;
  TileRow tiles(map);
  const std::int64_t oldest_allowed =
      query.max_age_s > 0 ? now_ns - static_cast<std::int64_t>(query.max_age_s * 1e9)
                          : std::numeric_limits<std::int64_t>::min();
  std::int64_t oldest = std::numeric_limits<std::int64_t>::max();
  bool never_seen = false;
  bool stale_anywhere = false;
  std::uint64_t unknown = 0;
  std::vector<Levels> no_go;
  for (const SweptPiece& piece : pieces) {
    const Levels levels = levels_of(piece.low_m, piece.high_m);
    double first_along = std::numeric_limits<double>::max();
    const bool decided = out.verdict == Verdict::kBlocked;
    for (const PolygonRow& row : rows_of(piece.hull, voxel)) {
      const ColumnTile* tile = nullptr;
      const HeightColumns* heights = nullptr;
      for (int x = row.first; x <= row.last; ++x) {
        if (x == row.first || in_tile(x) == 0) {
          const TileRow::Pair& here = tiles.at(tile_of(x), tile_of(row.row));
          tile = here.voxels;
          heights = here.heights;
        }
        const int column = in_tile(row.row) * kTileEdge + in_tile(x);
        // Eight at once where all of them are free, and seen not too long ago.
        if (column % kGroup == 0 && x + kGroup - 1 <= row.last && tile != nullptr &&
            tile->words > 0 && heights != nullptr) {
          const auto group = static_cast<std::size_t>(column / kGroup);
          const ColumnTile::CommonRun& run = tile->common[group];
          const std::int64_t seen = heights->oldest[group];
          if (run.first <= levels.low && levels.high < run.end && seen != 0 &&
              seen >= oldest_allowed) {
            out.columns += kGroup;
            highest.add(run);
            oldest = std::min(oldest, seen);
            x += kGroup - 1;
            continue;
          }
        }
        const ColumnHeight* surface =
            heights != nullptr ? &heights->columns[std::size_t(column)] : nullptr;
        ++out.columns;
        highest.add(tile, column);
        Levels needed = levels;
        // Heights are finer than voxels: a surface that ends below is not in the way.
        if (surface != nullptr && is_known(surface->state) &&
            surface->height_m + surface->spread_m <= piece.low_m &&
            static_cast<int>(std::floor(surface->height_m / voxel)) == levels.low)
          ++needed.low;
        ColumnAnswer answer = look(tile, column, needed);
        const std::int64_t seen = surface != nullptr ? surface->last_observed : 0;
        if (seen == 0)
          never_seen = true;
        else
          oldest = std::min(oldest, seen);
        const bool stale = seen != 0 && seen < oldest_allowed;
        stale_anywhere |= stale;
        if (answer.unknown || stale || (seen == 0 && query.max_age_s > 0)) ++unknown;
        const bool old = stale || (seen == 0 && query.max_age_s > 0);
        if (decided || (!answer.occupied && !answer.unknown && !old)) continue;
        const double px = (x + 0.5) * voxel;
        const double py = (row.row + 0.5) * voxel;
        const double along =
            (px - piece.start_x) * piece.along_x + (py - piece.start_y) * piece.along_y;
        if (out.verdict == Verdict::kBlocked && along >= first_along) continue;
        first_along = along;
        out.verdict = Verdict::kBlocked;
        const bool forgotten = surface != nullptr && surface->state == ColumnState::kStale;
        out.reason = answer.occupied                ? Reason::kObstacle
                     : answer.unknown && !forgotten ? Reason::kUnknown
                                                    : Reason::kStale;
        out.first_x_m = px;
        out.first_y_m = py;
        out.first_z_m = (answer.lowest + 0.5) * voxel;
      }
    }
    if (map.zones == nullptr) continue;
    for (const Zone& zone : *map.zones) {
      if (!zone.active) continue;
      const std::optional<ZoneMeeting> met = meet(piece, zone);
      if (!met) continue;
      if (zone.kind == Zone::Kind::kNoGo) no_go.push_back(levels_of(zone.z_min_m, zone.z_max_m));
      if (!same_heights(piece, zone)) continue;
      if (zone.kind == Zone::Kind::kSlowDown) {
        if (!out.slow_down && out.zone == 0) out.zone = zone.id;
        out.slow_down = true;
        continue;
      }
      if (decided || (out.verdict == Verdict::kBlocked && met->along >= first_along)) continue;
      first_along = met->along;
      out.verdict = Verdict::kBlocked;
      out.reason = Reason::kZone;
      out.zone = zone.id;
      out.first_x_m = met->x_m;
      out.first_y_m = met->y_m;
      out.first_z_m = std::max(piece.low_m, zone.z_min_m);
      out.text = zone.name;
    }
  }
  if (out.verdict != Verdict::kBlocked) out.verdict = Verdict::kClear;
  out.unknown_fraction = out.columns > 0 ? double(unknown) / double(out.columns) : 0;
  out.oldest_age_s = never_seen || oldest == std::numeric_limits<std::int64_t>::max()
                         ? -1
                         : std::max(0.0, double(now_ns - oldest) * 1e-9);
  // From the safe height up, margin below and box, hook and margin above must be free.
  const double needed_m = query.load.size_z_m + query.load.above_m + 2 * query.margins.vertical_m;
  const int count = static_cast<int>(std::ceil(needed_m / voxel)) + 1;
  const std::optional<int> lowest = highest.easy(count) && no_go.empty()
                                        ? highest.lowest_free()
                                        : lowest_free(pieces, voxel, tiles, no_go, count);
  const bool any_age = query.max_age_s <= 0 || (!stale_anywhere && !never_seen);
  out.safe_height_m = lowest && any_age ? *lowest * voxel + query.margins.vertical_m
                                        : std::numeric_limits<double>::quiet_NaN();
  if (out.verdict == Verdict::kBlocked) {
    char text[240];
    const std::string zone =
        "no-go zone " + std::to_string(out.zone) + (out.text.empty() ? "" : " '" + out.text + "'");
    const char* what = out.reason == Reason::kObstacle  ? "an obstacle"
                       : out.reason == Reason::kUnknown ? "space never seen, so not free"
                       : out.reason == Reason::kStale   ? "space not seen for too long"
                                                        : zone.c_str();
    std::snprintf(text, sizeof text, "%s at x %.2f, y %.2f, z %.2f m", what, out.first_x_m,
                  out.first_y_m, out.first_z_m);
    out.text = text;
  }
  return out;
}

}  // namespace crane::client
