// SPDX-License-Identifier: Apache-2.0
// Serves tiles, takes frames and answers commands until it is ended: what datagram_guard_test
// attacks. usage: guard_victim DOMAIN guarded|bare loopback|all [SECURITY]    on these interfaces;
// with a folder of DDS Security, as its mapper

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>
#include <utility>

#include "bounds.h"
#include "dds/endpoints.hpp"

namespace {
template <class T>
std::shared_ptr<T> shared(T&& reader) {
  return std::make_shared<T>(std::forward<T>(reader));
}
}  // namespace

int main(int argc, char** argv) {
  using namespace crane;
  if (argc != 4 && argc != 5) return 2;
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  dds::Settings settings;
  settings.domain = static_cast<std::uint32_t>(std::atoi(argv[1]));
  settings.shared_memory = false;
  settings.guard_datagrams = std::strcmp(argv[2], "guarded") == 0;
  if (std::strcmp(argv[3], "all") == 0) settings.interfaces.clear();
  if (argc == 5) {
    settings.security = argv[4];
    settings.identity = "mapper";
  }
  auto participant = *dds::Participant::create(settings, "victim");
  auto tiles = *dds::Writer<dds::MapTileTopic>::create(participant);
  std::shared_ptr<dds::Reader<dds::StereoFrameTopic>> frames;  // a mapper may not read them
  if (argc == 4) frames = shared(*dds::Reader<dds::StereoFrameTopic>::create(participant, nullptr));
  auto commands = *dds::Reader<dds::ZoneCommandTopic>::create(participant, nullptr);
  auto zones = *dds::Writer<dds::ZoneSetTopic>::create(participant);
  v1::MapTile tile;
  tile.crane(1);
  tile.voxel_m(0.05);
  tile.encoding(1);
  tile.payload(std::vector<std::uint8_t>(3000, 7));
  v1::ZoneSet set;
  set.crane(1);
  const pid_t parent = getppid();
  for (int n = 0; getppid() == parent; ++n) {
    tile.tile_x(static_cast<std::int16_t>(n % 50));
    (void)tiles.write(tile);
    while (frames && frames->take()) {
    }
    while (commands.take()) {
      set.revision(set.revision() + 1);
      (void)zones.write(set);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return 0;
}
