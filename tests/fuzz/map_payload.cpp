// SPDX-License-Identifier: Apache-2.0
// What comes inside tiles: voxels, heights, saved state. First as given, then as the content of an
// intact zstd frame, which is where the decoders' own checks begin.
#include <cstdint>
#include <span>

#include "map_codec/compression.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/tile_codec.hpp"
#include "map_codec/tile_snapshot.hpp"
#include "map_sync/held_map.hpp"

namespace {

void decode(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kRoom = 1U << 20U;
  crane::HeldMap held(1, kRoom);
  for (const std::int16_t band : {std::int16_t{0}, std::int16_t{-147}, std::int16_t{146}})
    if (const auto tile = crane::decode_tile(bytes, band))
      (void)held.put(held.prepare({0, 0, band}, 1, 1, *tile));
  if (const auto heights = crane::decode_heights(bytes))
    (void)held.put(crane::TileKey{0, 0}, 1, 1, {*heights, {}, {}});
  crane::expects(held.memory_bytes() <= kRoom, "what is held stays within its bound");
  crane::Bytes saved(bytes.begin(), bytes.end());
  const std::uint32_t crc = crane::crc32c(bytes);
  for (int i = 0; i < 4; ++i) saved.push_back(static_cast<std::uint8_t>(crc >> (8 * i)));
  crane::OccupancyMap map(0.05, 4U << 20U);
  (void)crane::read_snapshot(saved, map);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  decode({data, size});
  decode(crane::compress({data, size}, 1));
  return 0;
}
