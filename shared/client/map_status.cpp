// SPDX-License-Identifier: Apache-2.0
#include "client/map_status.hpp"

#include "bounds.h"

namespace crane::client {
namespace {

static_assert(int(Status::Hoist::kNotUsed) == v1::HOIST_NOT_USED &&
              int(Status::Hoist::kKnown) == v1::HOIST_KNOWN &&
              int(Status::Hoist::kLost) == v1::HOIST_LOST);
static_assert(int(Zone::Kind::kNoGo) == v1::ZONE_NO_GO &&
              int(Zone::Kind::kSlowDown) == v1::ZONE_SLOW_DOWN);

}  // namespace

std::vector<Zone> zones_of(const MapFollower& follower) {
  std::vector<Zone> out;
  if (!follower.zones()) return out;
  for (const v1::Zone& z : follower.zones()->zones()) {
    Zone zone;
    zone.id = z.id();
    zone.kind = static_cast<Zone::Kind>(z.kind());
    zone.active = z.active() == 1;
    zone.switchable = z.switchable() == 1;
    zone.z_min_m = z.z_min_m();
    zone.z_max_m = z.z_max_m();
    zone.name = z.name().c_str();
    for (const v1::ZoneCorner& c : z.corners()) zone.corners.push_back({c.x_m(), c.y_m()});
    out.push_back(std::move(zone));
  }
  return out;
}

Status status_of(const MapFollower& follower) {
  Status out;
  const HeldMap& held = follower.held();
  out.voxel_digest = held.voxel_digests().all;
  out.height_digest = held.height_digests().all;
  out.tiles = held.voxel_tiles();
  out.memory_bytes = held.memory_bytes();
  out.zones_revision = follower.zones_revision();
  out.samples_refused = follower.refused();
  out.resyncs = follower.resyncs();
  if (follower.ended()) {
    out.reason = "the participant that was given to join() ended before the map did";
    return out;
  }
  if (!follower.said()) {
    out.reason = "no mapper heard yet";
    return out;
  }
  const v1::MapStatus& s = *follower.said();
  out.heard = true;
  out.alive = follower.silence() < std::chrono::seconds(1);
  out.valid = out.alive && s.validity() == 0 && follower.trouble().empty();
  out.complete = follower.complete();
  out.reason = !out.alive                   ? "no heartbeat of the mapper for more than 1 s"
               : follower.trouble().empty() ? s.reason().c_str()
                                            : follower.trouble();
  out.reason_code = s.reason_code();
  out.mapper = s.mapper();
  out.map_id = s.map_id();
  out.revision = s.revision();
  out.voxel_m = s.voxel_m();
  out.stream = s.stream();
  out.last_frame = s.last_frame();
  out.last_frame_time_ns = s.last_frame_time_ns();
  out.frames_integrated = s.frames_integrated();
  out.frames_rejected = s.frames_rejected();
  out.frames_missing = s.frames_missing();
  out.hoist = static_cast<Status::Hoist>(s.hoist());
  out.ceiling_m = s.ceiling_m();
  out.forget_s = s.forget_s();
  return out;
}

}  // namespace crane::client
