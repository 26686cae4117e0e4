// SPDX-License-Identifier: Apache-2.0
#include "mapper/standby.hpp"

#include "base/log.hpp"
#include "mapper/map_gauges.hpp"

namespace crane {
namespace {

FrameAccount account_of(const v1::MapStatus& s) {
  FrameAccount a;
  a.stream = s.stream();
  a.last_frame = s.last_frame_time_ns() > 0 ? static_cast<std::int64_t>(s.last_frame()) : -1;
  a.last_frame_time = s.last_frame_time_ns();
  a.integrated = s.frames_integrated();
  a.rejected = s.frames_rejected();
  a.missing = s.frames_missing();
  return a;
}

}  // namespace

Result<Standby> Standby::create(const std::shared_ptr<dds::Participant>& participant,
                                Wakeup* wakeup, std::size_t max_bytes) {
  auto follower = MapFollower::create(participant, wakeup, max_bytes);
  if (!follower) return follower.error();
  return Standby(std::move(*follower), wakeup);
}

Result<bool> Standby::wait(ServiceContext& context, MapperInputs& inputs,
                           MappingPipeline& pipeline) {
  StatusReporter& status = context.status;
  status.serve_as(v1::SERVICE_STANDBY);
  bool cut_off = false;
  while (!context.stopping()) {
    wakeup_->wait_for(std::chrono::milliseconds(20));
    if (auto done = step(pipeline); !done) return done.error();
    inputs.take_motion(pipeline);
    if (context.reload()) log_warning("SIGHUP: a standby reads nothing again");
    // With the rangefinders silent too it is us who are cut off: nobody would be served.
    const bool witness = inputs.hears_rangefinders();
    if (silent() && witness) {
      status.serve_as(v1::SERVICE_MAPPER);
      return true;
    }
    if (silent() && !cut_off)
      log_error("neither the mapper nor a rangefinder is heard: waits until one is");
    cut_off = silent();
    status.status = cut_off || !current() ? v1::STATUS_DEGRADED : v1::STATUS_OK;
    status.message = cut_off     ? "hears neither the mapper nor a rangefinder"
                     : current() ? "holds the map that is served"
                                 : "does not hold all of the map";
    status.gauges = {tiles_gauge(pipeline.map().tile_count())};
    status.tick();
  }
  return false;
}

Result<void> Standby::step(MappingPipeline& pipeline) {
  std::vector<TileKey> changed = follower_->step();
  const auto& said = follower_->said();
  if (!said) return {};
  if (said->voxel_m() != pipeline.voxel_m())
    return Error{ErrorCode::kConfiguration, "mapper.voxel_m",
                 std::to_string(pipeline.voxel_m()) + " differs from " +
                     std::to_string(said->voxel_m()) + " of the mapper that serves",
                 "give both the same configuration"};
  const HeldMap& held = follower_->held();
  pipeline.adopt(account_of(*said), static_cast<HoistKnown>(said->hoist()), MonotonicClock().now());
  if (held.map_id() != map_id_) {
    pipeline.clear();
    map_id_ = held.map_id();
    complete_at_ = {};
    changed.clear();
    for (const auto& [key, tile] : held.tiles()) changed.push_back(key);
  }
  for (const TileKey key : changed) {
    static const HeldMap::HeldTile kNothing;
    const auto it = held.tiles().find(key);
    const auto& tile = it == held.tiles().end() ? kNothing : it->second;
    pipeline.adopt(key, tile.blocks, tile.heights.columns);
  }
  if (follower_->complete()) complete_at_ = std::chrono::steady_clock::now();
  return {};
}

bool Standby::current() const {
  return std::chrono::steady_clock::now() - complete_at_ < std::chrono::seconds(5);
}

bool Standby::silent() const {
  return follower_->said() && follower_->silence() > kSilence;
}

}  // namespace crane
