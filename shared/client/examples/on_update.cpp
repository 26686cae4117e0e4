// SPDX-License-Identifier: Apache-2.0
// Is told of every change as it comes, instead of asking.
// usage: cranemap-example-on-update [SECONDS [DOMAIN [CRANE]]]

#include <crane/client/map.hpp>

#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <thread>

int main(int argc, char** argv) {
  const int seconds = argc > 1 ? std::atoi(argv[1]) : 10;
  crane::client::Options options;
  if (argc > 2) options.domain = static_cast<std::uint32_t>(std::atoi(argv[2]));
  if (argc > 3) options.crane = static_cast<std::uint32_t>(std::atoi(argv[3]));

  std::string error;
  const auto map = crane::client::Map::join(options, error);
  if (!map) {
    std::fprintf(stderr, "cannot join: %s\n", error.c_str());
    return 3;
  }
  // Called by the thread that follows the map: quick, and free to ask the map anything.
  std::atomic<int> updates{0};
  map->on_update([&](const crane::client::Update& update) {
    ++updates;
    crane::client::Area all = update.areas.front();
    for (const crane::client::Area& a : update.areas) {
      all.x0_m = a.x0_m < all.x0_m ? a.x0_m : all.x0_m;
      all.y0_m = a.y0_m < all.y0_m ? a.y0_m : all.y0_m;
      all.x1_m = a.x1_m > all.x1_m ? a.x1_m : all.x1_m;
      all.y1_m = a.y1_m > all.y1_m ? a.y1_m : all.y1_m;
    }
    std::printf("revision %" PRIu64 ": %zu tiles changed within x %.2f..%.2f, y %.2f..%.2f m; %s\n",
                update.revision, update.areas.size(), all.x0_m, all.x1_m, all.y0_m, all.y1_m,
                update.valid ? update.complete ? "complete" : "more to come" : "not valid");
  });
  std::this_thread::sleep_for(std::chrono::seconds(seconds));
  map->on_update(nullptr);
  std::printf("%d updates in %d s\n", updates.load(), seconds);
  return updates > 0 ? 0 : 4;
}
