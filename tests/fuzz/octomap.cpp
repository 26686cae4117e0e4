// SPDX-License-Identifier: Apache-2.0
// Map files as anybody may hand them to `cranemap evaluate`: what passes the check is then read by
// OctoMap, which checks nothing.
#include <cstdint>
#include <cstdlib>

#include "map_codec/octomap_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto checked = crane::check_octomap({data, size}, "fuzz");
  if (!checked) return 0;
  // What was checked is what OctoMap makes of it.
  const auto read = crane::decode_octomap({data, data + size}, "fuzz");
  if (!read) return 0;
  if (read->voxel_m != checked->voxel_m) std::abort();
  if (read->occupied.size() + read->free.size() > checked->nodes) std::abort();
  return 0;
}
