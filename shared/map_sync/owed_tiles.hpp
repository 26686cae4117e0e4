// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <unordered_map>

#include "map_codec/tile_codec.hpp"

namespace crane {

/// What a mapper sends again because subscribers lack it. All of them hear it when it is sent, so a
/// tile goes out once for however many ask, and not again right away: who asks all the time gets no
/// more than who asks when it must. The clock is passed in. One thread.
class OwedTiles {
 public:
  using Clock = std::chrono::steady_clock;
  /// Shorter than a subscriber waits before it asks again.
  static constexpr std::chrono::milliseconds kPause{600};

  struct Lack {
    bool voxels = false, heights = false;
  };
  /// By the digests of what a subscriber holds and of what there is. `keys`: all that there is, as
  /// the keys of a map.
  template <class Digests, class Published>
  void note(const Digests& voxels_held, const Digests& heights_held, const BucketDigests& voxels,
            const BucketDigests& heights, const Published& published, Clock::time_point now) {
    for (const auto& [key, what] : published) {
      const std::size_t bucket = BucketDigests::bucket_of(key);
      note(key,
           {voxels_held[bucket] != voxels.buckets[bucket],
            heights_held[bucket] != heights.buckets[bucket]},
           now);
    }
  }
  struct Owed {
    TileKey key;
    Lack lack;
  };
  /// The next one to be sent, which counts as sent now.
  std::optional<Owed> next(Clock::time_point now);
  [[nodiscard]] bool empty() const { return owed_.empty(); }

 private:
  void note(TileKey key, Lack lack, Clock::time_point now);

  std::map<TileKey, Lack> owed_;
  std::unordered_map<TileKey, Clock::time_point, TileKeyHash> sent_;  ///< lately
};

}  // namespace crane
