// SPDX-License-Identifier: Apache-2.0
// Before a move: may the load go there, how high must it be, and how do we know?
// usage: cranemap-example-clearance-before-move [X0 Y0 X1 Y1 Z [DOMAIN [CRANE]]]
// From, to, and the underside of the load [m]. Exit code: 0 clear, 1 blocked, 4 no answer.

#include <crane/client/map.hpp>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  double to_move[5] = {2.3, 1.5, 2.8, 1.5, 0.3};
  for (int i = 0; i < 5 && argc > i + 1; ++i) to_move[i] = std::atof(argv[i + 1]);
  const auto [x0, y0, x1, y1, z] = to_move;
  crane::client::Options options;
  if (argc > 6) options.domain = static_cast<std::uint32_t>(std::atoi(argv[6]));
  if (argc > 7) options.crane = static_cast<std::uint32_t>(std::atoi(argv[7]));

  std::string error;
  const auto map = crane::client::Map::join(options, error);
  if (!map) {
    std::fprintf(stderr, "cannot join: %s\n", error.c_str());
    return 3;
  }
  (void)map->wait_until_complete(std::chrono::seconds(10));  // clearance() says so if it is not

  crane::client::ClearanceQuery query;
  query.path = {{x0, y0, z, 0}, {x1, y1, z, 0}};  // straight legs; the last value is the yaw
  // Length, width, height; hook and slings above it. Without the last number all space up to the
  // rope's top must be free: whoever says less answers for what hangs higher.
  query.load = {0.3, 0.3, 0.2, 0.2};
  query.margins = {0.1, 0.1, 0.05, 0.1};  // sideways, up and down, sway, braking
  crane::client::Clearance c = map->clearance(query);
  // Blocked: higher, where it is clear again, as a controller would. Never lower: the load may be
  // above something that must be passed to get there.
  if (c.verdict == crane::client::Verdict::kBlocked && c.safe_height_m > z) {
    std::printf("blocked at %.2f m: %s; clear from %.2f to %.2f m\n", z, c.text.c_str(),
                c.safe_low_m, c.safe_high_m);
    for (crane::client::Pose& p : query.path) p.z_m = c.safe_height_m;
    c = map->clearance(query);
  }
  switch (c.verdict) {
    case crane::client::Verdict::kClear:
      std::printf("clear at %.2f m%s; oldest column seen %.1f s ago\n", query.path[0].z_m,
                  c.slow_down ? ", slowly" : "", c.oldest_age_s);
      return 0;
    case crane::client::Verdict::kBlocked:
      std::printf(
          "blocked, and nothing at or above %.2f m is known to be clear: %s; "
          "%.1f %% of the way unknown\n",
          z, c.text.c_str(), 100 * c.unknown_fraction);
      return 1;
    default:
      std::printf("no answer, so do not move: %s\n", c.text.c_str());
      return 4;
  }
}
