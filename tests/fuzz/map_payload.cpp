// What comes inside tiles: voxels, heights, saved state. First as given, then as the content of an
// intact zstd frame, which is where the decoders' own checks begin.
#include <cstdint>
#include <span>

#include "map_codec/compression.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/tile_codec.hpp"
#include "map_codec/tile_snapshot.hpp"

namespace {

void decode(std::span<const std::uint8_t> bytes) {
  (void)crane::decode_tile(bytes, 0);
  (void)crane::decode_heights(bytes);
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
