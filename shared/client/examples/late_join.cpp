// SPDX-License-Identifier: Apache-2.0
// Joins whenever it likes, gets the whole current map, and asks it one thing.
// usage: cranemap-example-late-join [X Y [DOMAIN [CRANE]]]   metres in the map frame

#include <crane/client/map.hpp>

#include <cinttypes>
#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  const double x = argc > 1 ? std::atof(argv[1]) : 0.75;
  const double y = argc > 2 ? std::atof(argv[2]) : 0.55;
  crane::client::Options options;
  if (argc > 3) options.domain = static_cast<std::uint32_t>(std::atoi(argv[3]));
  if (argc > 4) options.crane = static_cast<std::uint32_t>(std::atoi(argv[4]));

  std::string error;
  const auto map = crane::client::Map::join(options, error);
  if (!map) {
    std::fprintf(stderr, "cannot join: %s\n", error.c_str());
    return 3;
  }
  if (!map->wait_until_complete(std::chrono::seconds(10))) {
    std::fprintf(stderr, "no complete map within 10 s: %s\n", map->status().reason.c_str());
    return 4;
  }
  const auto status = map->status();
  const auto voxels = map->count_voxels();
  std::printf("map %016" PRIx64 " revision %" PRIu64 ": %u tiles, %" PRIu64
              " voxels occupied, %" PRIu64 " free, digest %016" PRIx64 "\n",
              status.map_id, status.revision, status.tiles, voxels.occupied, voxels.free,
              status.voxel_digest + status.height_digest);
  const auto height = map->height(x, y);
  if (!crane::client::is_known(height.surface))
    std::printf("height at (%.2f, %.2f): unknown, so not free\n", x, y);
  else
    std::printf("height at (%.2f, %.2f): %s%.4f m (%s)\n", x, y,
                height.lower_bound ? "at least " : "", height.height_m,
                height.surface == crane::client::Surface::kFloor ? "floor" : "obstacle");
}
