// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "crane/client/map.hpp"

namespace crane::gateway {

/// Edge of a tile in columns: as height tiles have it.
inline constexpr int kTileEdge = 32;

struct TileAt {
  int x = 0, y = 0;
  auto operator<=>(const TileAt&) const = default;
};

/// A tile of the stream, little-endian: int32 x, y; 1024 float32 heights [m], NaN = none; 1024
/// uint32 times last observed [s since the Unix epoch, 0 = never]; 1024 uint8 flags (0 unknown, 1
/// floor, 2 obstacle, 3 stale; plus 4: the height is a lower bound); 1024 uint8 numbers of frames.
/// Index y * 32 + x.
std::string encode_tile(TileAt at, const std::vector<client::Height>& columns);

/// The newest bytes of each tile, in the order in which they changed: who follows it remembers one
/// number. A tile that changes again moves to the end, so nothing is ever said twice or late. Any
/// thread.
class TileLog {
 public:
  void put(TileAt at, std::string bytes);
  /// Another map: all of the old one is gone.
  void begin_anew();

  struct Batch {
    std::uint32_t generation = 0;
    std::uint64_t until = 0;  ///< to go on from
    std::vector<std::shared_ptr<const std::string>> tiles;
  };
  /// What changed after `from` of that generation (of another one: all), `most` tiles.
  [[nodiscard]] Batch after(std::uint32_t generation, std::uint64_t from, std::size_t most) const;
  [[nodiscard]] std::uint32_t generation() const;
  [[nodiscard]] std::size_t size() const;

 private:
  struct Entry {
    TileAt at;
    std::shared_ptr<const std::string> bytes;
  };
  mutable std::mutex mutex_;
  std::uint32_t generation_ = 1;
  std::uint64_t last_ = 0;
  std::map<std::uint64_t, Entry> by_change_;
  std::map<TileAt, std::uint64_t> change_of_;
};

}  // namespace crane::gateway
