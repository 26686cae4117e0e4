// SPDX-License-Identifier: Apache-2.0
// Saves the map as it is now for octovis and every other reader of OctoMap files.
// usage: cranemap-example-save-bt FILE.bt [DOMAIN [CRANE]]

#include <crane/client/map.hpp>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "map.bt";
  crane::client::Options options;
  if (argc > 2) options.domain = static_cast<std::uint32_t>(std::atoi(argv[2]));
  if (argc > 3) options.crane = static_cast<std::uint32_t>(std::atoi(argv[3]));

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
  if (!map->save_bt(path, error)) {
    std::fprintf(stderr, "%s\n", error.c_str());
    return 3;
  }
  const auto voxels = map->count_voxels();
  std::printf("%s: %llu voxels occupied, %llu free\n", path.c_str(),
              static_cast<unsigned long long>(voxels.occupied),
              static_cast<unsigned long long>(voxels.free));
}
