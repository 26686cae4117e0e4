// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "base/result.hpp"
#include "dds/settings.hpp"

namespace crane::dds {

/// A file in /dev/shm that is locked as long as the process lives. The kernel drops the lock with
/// the process, however it ends, and the lock is seen across containers that share /dev/shm, unlike
/// a process id.
class HeldFile {
 public:
  HeldFile() = default;
  /// Nothing when another holds it, or the directory cannot be written.
  static std::optional<HeldFile> take(const std::string& path);
  ~HeldFile();
  HeldFile(HeldFile&& other) noexcept;
  HeldFile& operator=(HeldFile&& other) noexcept;

 private:
  HeldFile(std::string path, int file) : path_(std::move(path)), file_(file) {}

  std::string path_;
  int file_ = -1;
};

/// Marks the data-sharing segments of one participant as living.
/// `guid_prefix`: as Fast DDS puts it into the names of its segments.
HeldFile mark_segments(const std::string& guid_prefix, const std::string& directory = "/dev/shm");

/// A port of Fast DDS's shared-memory transport that nobody listens at, and that no killed process
/// listened at whom living ones still have open: those go on writing to that one, unheard. By its
/// own rule Fast DDS gives a restarted process the port of the killed one.
struct ShmPort {
  std::uint32_t number = 0;
  HeldFile claim;
};
/// Error: Resource when the directory cannot be written, or all 4096 are taken.
Result<ShmPort> claim_shm_port(const std::string& directory = "/dev/shm");

/// Whether somebody listens at the port.
bool is_port_open(std::uint32_t number, const std::string& directory = "/dev/shm");

/// Removes what dead processes left in shared memory: data-sharing segments with one of our locks
/// that nobody holds, Fast DDS transport segments whose own lock files nobody holds, and its ports
/// that besides nobody has open. Locks and open files are asked of the kernel, which knows those of
/// other containers as well; files of another user are never touched, nor what a living process
/// uses. Returns the number of files removed.
std::size_t remove_stale_segments(const std::string& directory = "/dev/shm");

/// Whether a file of shared memory that was opened is one to use: a regular file of this user or
/// root that nobody else may write. What another user put there under a name that Fast DDS looks
/// for would be mapped, and believed. `name`: for the log.
bool use_segment(const char* name, int file);

/// What a process of these settings needs there: its own segment, and beside it what frames and
/// clouds take on their way without a copy. 0 without shared memory.
std::uint64_t shared_memory_needed(const Settings& settings);

/// Error: Resource when the directory has less than `needed` bytes free or cannot be written;
/// Fast DDS itself would end with SIGBUS and no message.
Result<void> check_shared_memory(std::uint64_t needed, const std::string& directory = "/dev/shm");

}  // namespace crane::dds
