// SPDX-License-Identifier: Apache-2.0
#include "mapper/map_validity.hpp"

#include <cmath>
#include <cstdio>
#include <string>

#include "bounds.h"

namespace crane {
namespace {

std::string jump_text(const char* axis, double jump_m) {
  char text[200];
  std::snprintf(text, sizeof text,
                "the %s's rangefinder jumped by %.2f m and no frame confirms it: is its beam free, "
                "its reflector in place? no frame is used",
                axis, jump_m);
  return text;
}

std::string apart_text(double apart_s) {
  char text[200];
  std::snprintf(text, sizeof text,
                "hoist_state is %.0f s %s than the exposures: another clock, or a recording played "
                "with its own time stamps; hook and load are not known",
                std::abs(apart_s), apart_s > 0 ? "later" : "earlier");
  return text;
}

}  // namespace

MapPublisher::Health judge_validity(const PipelineReport& r, bool being_made, TimeNs stale_after,
                                    TimeNs now) {
  const auto degraded = [](std::uint32_t code, std::string reason) {
    return MapPublisher::Health{v1::STATUS_DEGRADED, code, std::move(reason)};
  };
  if (r.refused == Cause::kCloudOtherCalibration)
    return degraded(v1::MAP_OTHER_CALIBRATION,
                    "clouds were made with another calibration: give stereo and mapper the same");
  if (r.account.last_frame < 0)
    return {v1::STATUS_FAILED, v1::MAP_NOTHING_YET, "no cloud could be placed yet"};
  if (being_made)
    return degraded(v1::MAP_BEING_MADE, "paper: the map is made anew when no cloud waits");
  if (r.watch == WatchState::kWrong)
    return degraded(
        is_of_positions(r.misfit.suspect) ? v1::MAP_POSITIONS_WRONG : v1::MAP_CALIBRATION_WRONG,
        text_of(r.misfit) + "; then map anew: no frame is used");
  if (r.trust == Trust::kCartReversed || r.trust == Trust::kTrolleyReversed) {
    const std::string axis = r.trust == Trust::kCartReversed ? "cart" : "trolley";
    return degraded(v1::MAP_CONTRADICTED, "frames move as if the " + axis +
                                              "'s rangefinder counted the other way: set "
                                              "mapper." +
                                              axis + "_direction, and map anew; no frame is used");
  }
  if (r.trust == Trust::kContradicted)
    return degraded(
        v1::MAP_CONTRADICTED,
        "frames see what lies elsewhere in the map: check direction, offset and latency of the "
        "rangefinders, then start the mapper anew; no frame is used");
  if (r.trust == Trust::kCartJumped)
    return degraded(v1::MAP_CART_POSITION, jump_text("cart", r.jump_m));
  if (r.trust == Trust::kTrolleyJumped)
    return degraded(v1::MAP_TROLLEY_POSITION, jump_text("trolley", r.jump_m));
  if (r.memory_full)
    return degraded(v1::MAP_MEMORY_FULL,
                    "the map has reached mapper.max_memory_mib, what is new is not kept: raise it");
  if (now - r.last_arrival > stale_after)
    return degraded(v1::MAP_NO_CLOUDS,
                    "no cloud for more than " + std::to_string(stale_after / 1'000'000) + " ms");
  if (r.hoist == HoistKnown::kLost && r.hoist_apart_s != 0)
    return degraded(v1::MAP_HOIST_OF_ANOTHER_TIME, apart_text(r.hoist_apart_s));
  if (r.hoist == HoistKnown::kLost)
    return degraded(v1::MAP_HOIST_LOST,
                    "no hoist_state: what hangs below the trolley is not known");
  if (r.watch == WatchState::kDrifting) return {v1::STATUS_OK, v1::MAP_DRIFTING, text_of(r.misfit)};
  return {};
}

}  // namespace crane
