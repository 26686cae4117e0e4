// SPDX-License-Identifier: Apache-2.0
#include "gateway/map_feed.hpp"

#include <cstring>

namespace crane::gateway {
namespace {

constexpr std::size_t kMostTiles = 32;  // 320 KiB
constexpr std::uint32_t kMagic = 0x31544D43;

}  // namespace

std::optional<http::Message> MapFeed::next() {
  if (const auto state = board_.now(); state.number != said_) {
    said_ = state.number;
    return http::Message{*state.json, false};
  }
  if (said_ == 0) return std::nullopt;  // what tiles are of is said first
  const auto batch = tiles_.after(generation_, until_, kMostTiles);
  generation_ = batch.generation;
  until_ = batch.until;
  if (batch.tiles.empty()) return std::nullopt;
  const std::uint32_t head[4] = {kMagic, generation_, std::uint32_t(batch.tiles.size()), 0};
  http::Message out;
  out.binary = true;
  out.bytes.reserve(sizeof head + batch.tiles.size() * batch.tiles.front()->size());
  out.bytes.append(reinterpret_cast<const char*>(head), sizeof head);
  for (const auto& tile : batch.tiles) out.bytes += *tile;
  return out;
}

}  // namespace crane::gateway
