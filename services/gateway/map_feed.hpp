// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/state_board.hpp"
#include "gateway/tile_log.hpp"
#include "http/feed.hpp"

namespace crane::gateway {

/// What one page is told: the newest state as text, and as bytes the tiles that changed since it
/// last had any: uint32 'CMT1', generation, number of tiles, 0, then those (encode_tile). A page
/// that reads slowly is told less often, never late.
class MapFeed final : public http::Feed {
 public:
  MapFeed(const StateBoard& board, const TileLog& tiles) : board_(board), tiles_(tiles) {}
  std::optional<http::Message> next() override;

 private:
  const StateBoard& board_;
  const TileLog& tiles_;
  std::uint64_t said_ = 0, until_ = 0;
  std::uint32_t generation_ = 0;
};

}  // namespace crane::gateway
