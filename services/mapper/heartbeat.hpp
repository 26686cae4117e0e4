// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dds/endpoints.hpp"
#include "mapper/map_publisher.hpp"

namespace crane {

/// Says map_status: when the map changes, and at least five times a second from a thread of its
/// own, so that no long piece of work (tiles for a late joiner, the octree of a large hall, a full
/// disk) makes a healthy mapper look dead and be deposed. A mapper that really hangs falls silent.
/// Any thread.
class Heartbeat {
 public:
  /// The mapper's loop must have turned within this, or no heartbeat is sent any more. Less than
  /// that is a long piece of work.
  static constexpr std::chrono::seconds kHangs{10};

  static Result<std::unique_ptr<Heartbeat>> create(
      const std::shared_ptr<dds::Participant>& participant, const MapPublisher::Identity& identity);
  ~Heartbeat();

  /// From now on at least every 0.2 s, whatever was said last. `stale_after`: without a cloud
  /// for so long it says that no clouds come.
  void keep_on(std::chrono::milliseconds stale_after, std::chrono::milliseconds hangs = kHangs);
  /// The mapper's loop turns; `clouds`: and clouds have come up to now.
  void alive(TimeNs last_cloud);
  /// Says this now, and again until something else is to be said.
  void say(v1::MapStatus status);
  /// Another mapper's last heartbeat as ours: we hold what it served, and its tiles follow.
  void take_over(v1::MapStatus last);
  /// Statuses that DDS did not take.
  [[nodiscard]] std::uint64_t not_accepted() const;
  void flush(std::chrono::milliseconds limit);

 private:
  struct Impl;
  explicit Heartbeat(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
