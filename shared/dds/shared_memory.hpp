#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.hpp"
#include "dds/settings.hpp"

namespace crane::dds {

/// Marks the data-sharing segments of one participant as living: a file in /dev/shm, locked as
/// long as the process lives. The kernel drops the lock with the process, however it ends, and
/// the lock is seen across containers that share /dev/shm, unlike a process id.
class SegmentLock {
 public:
  SegmentLock() = default;
  /// `guid_prefix`: as Fast DDS puts it into the names of its segments.
  explicit SegmentLock(const std::string& guid_prefix, const std::string& directory = "/dev/shm");
  ~SegmentLock();
  SegmentLock(SegmentLock&& other) noexcept;
  SegmentLock& operator=(SegmentLock&& other) noexcept;

 private:
  std::string path_;
  int file_ = -1;
};

/// Removes what dead processes left in shared memory: data-sharing segments with one of our locks
/// that nobody holds, and Fast DDS transport segments and ports whose own lock files nobody holds.
/// What a living process uses is never touched. Returns the number of files removed.
std::size_t remove_stale_segments(const std::string& directory = "/dev/shm");

/// What a process of these settings needs there: its own segment, and beside it what frames and
/// clouds take on their way without a copy. 0 without shared memory.
std::uint64_t shared_memory_needed(const Settings& settings);

/// Error: Resource when the directory has less than `needed` bytes free or cannot be written;
/// Fast DDS itself would end with SIGBUS and no message.
Result<void> check_shared_memory(std::uint64_t needed, const std::string& directory = "/dev/shm");

}  // namespace crane::dds
