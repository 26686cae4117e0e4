// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "map_sync/map_follower.hpp"
#include "mapper/mapper_inputs.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "service/run_service.hpp"

namespace crane {

/// Follows the map of the mapper that serves, so that ours is the same when that falls silent.
class Standby {
 public:
  /// A heartbeat comes at least every 0.2 s. Subscribers wait for a second.
  static constexpr std::chrono::milliseconds kSilence{600};

  /// `max_bytes`: of what it holds as it came, beside the map that is made of it.
  static Result<Standby> create(const std::shared_ptr<dds::Participant>& participant,
                                Wakeup* wakeup, std::size_t max_bytes);

  /// Follows, and says so, until it is time to take over (true) or to stop (false).
  /// Error: Configuration when the maps cannot be the same.
  Result<bool> wait(ServiceContext& context, MapperInputs& inputs, MappingPipeline& pipeline);

  /// The last heartbeat, once one came.
  [[nodiscard]] const std::optional<v1::MapStatus>& said() const { return follower_->said(); }
  /// Whether ours is that map, tile for tile, but for what came since: it was within 5 s.
  [[nodiscard]] bool current() const;
  [[nodiscard]] const std::optional<v1::ZoneSet>& zones() const { return follower_->zones(); }

 private:
  Standby(std::unique_ptr<MapFollower> follower, Wakeup* wakeup)
      : follower_(std::move(follower)), wakeup_(wakeup) {}
  /// Takes what arrived into the pipeline.
  Result<void> step(MappingPipeline& pipeline);
  /// Whether a mapper was heard, and then not for kSilence.
  [[nodiscard]] bool silent() const;

  std::unique_ptr<MapFollower> follower_;
  Wakeup* wakeup_;
  std::uint64_t map_id_ = 0;  ///< of what the pipeline has
  std::chrono::steady_clock::time_point complete_at_{};
};

}  // namespace crane
