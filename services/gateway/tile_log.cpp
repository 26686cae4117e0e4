// SPDX-License-Identifier: Apache-2.0
#include "gateway/tile_log.hpp"

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "base/expects.hpp"

namespace crane::gateway {

static_assert(std::endian::native == std::endian::little);

std::string encode_tile(TileAt at, const std::vector<client::Height>& columns) {
  constexpr std::size_t n = kTileEdge * kTileEdge;
  expects(columns.size() == n, "a tile has 32 x 32 columns");
  std::string out(8 + n * (4 + 4 + 1 + 1), '\0');
  const std::int32_t key[2] = {at.x, at.y};
  std::memcpy(out.data(), key, sizeof key);
  for (std::size_t i = 0; i < n; ++i) {
    const client::Height& h = columns[i];
    const float height = client::is_known(h.surface) ? static_cast<float>(h.height_m)
                                                     : std::numeric_limits<float>::quiet_NaN();
    const auto seen = static_cast<std::uint32_t>(h.last_observed_ns / 1'000'000'000);
    std::memcpy(out.data() + 8 + 4 * i, &height, 4);
    std::memcpy(out.data() + 8 + 4 * (n + i), &seen, 4);
    out[8 + 8 * n + i] = static_cast<char>(int(h.surface) + (h.lower_bound ? 4 : 0));
    out[8 + 9 * n + i] = static_cast<char>(h.views);
  }
  return out;
}

void TileLog::put(TileAt at, std::string bytes) {
  auto shared = std::make_shared<const std::string>(std::move(bytes));
  const std::lock_guard lock(mutex_);
  if (const auto old = change_of_.find(at); old != change_of_.end()) by_change_.erase(old->second);
  change_of_[at] = ++last_;
  by_change_[last_] = {at, std::move(shared)};
}

void TileLog::begin_anew() {
  const std::lock_guard lock(mutex_);
  ++generation_;
  by_change_.clear();
  change_of_.clear();
}

TileLog::Batch TileLog::after(std::uint32_t generation, std::uint64_t from,
                              std::size_t most) const {
  const std::lock_guard lock(mutex_);
  Batch out;
  out.generation = generation_;
  out.until = generation == generation_ ? from : 0;
  for (auto at = by_change_.upper_bound(out.until);
       at != by_change_.end() && out.tiles.size() < most; ++at) {
    out.tiles.push_back(at->second.bytes);
    out.until = at->first;
  }
  return out;
}

std::uint32_t TileLog::generation() const {
  const std::lock_guard lock(mutex_);
  return generation_;
}

std::size_t TileLog::size() const {
  const std::lock_guard lock(mutex_);
  return change_of_.size();
}

}  // namespace crane::gateway
