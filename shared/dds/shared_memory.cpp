// SPDX-License-Identifier: Apache-2.0
#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "base/log.hpp"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;
constexpr const char* kLockPrefix = "cranemap_lock_";
constexpr const char* kClaimPrefix = "cranemap_port_";
constexpr const char* kPortPrefix = "fastrtps_port";
/// Beyond those that Fast DDS reckons from domain and participant.
constexpr std::uint32_t kFirstPort = 1'000'000;
constexpr std::uint32_t kPorts = 4096;

bool is_ours(const struct stat& file) {
  return S_ISREG(file.st_mode) && file.st_uid == geteuid();
}

bool is_something(const fs::path& path) {
  struct stat file {};
  return lstat(path.c_str(), &file) == 0;
}

/// Another user's, or no file at all: /dev/shm belongs to everybody.
bool is_squatted(const fs::path& path) {
  struct stat file {};
  return lstat(path.c_str(), &file) == 0 && !is_ours(file);
}

/// A file of ours that is there already, open; -1 when it is none.
int open_ours(const fs::path& path, int flags) {
  const int file = open(path.c_str(), flags | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  struct stat found {};
  if (file < 0 || (fstat(file, &found) == 0 && is_ours(found))) return file;
  close(file);
  return -1;
}

/// Holds a lock on a file of ours if nobody else does.
class TryLock {
 public:
  explicit TryLock(const fs::path& path) : file_(open_ours(path, O_RDWR)) {
    held_ = file_ >= 0 && flock(file_, LOCK_EX | LOCK_NB) == 0;
  }
  ~TryLock() {
    if (file_ >= 0) close(file_);
  }
  TryLock(const TryLock&) = delete;
  TryLock& operator=(const TryLock&) = delete;
  [[nodiscard]] bool held() const { return held_; }

 private:
  int file_;
  bool held_ = false;
};

/// That nobody on this machine has a file of ours open or mapped: the kernel gives a write lease
/// only then, whatever the other's container, process ids or user. /proc shows less. Who opens the
/// file meanwhile waits in open() until this ends.
class Unused {
 public:
  explicit Unused(const fs::path& path) : file_(open_ours(path, O_RDONLY)) {
    // Who waits is said by a signal: one that ends nobody. (The default, SIGIO, does.)
    held_ =
        file_ >= 0 && fcntl(file_, F_SETSIG, SIGURG) == 0 && fcntl(file_, F_SETLEASE, F_WRLCK) == 0;
  }
  ~Unused() {
    if (file_ >= 0) close(file_);
  }
  Unused(const Unused&) = delete;
  Unused& operator=(const Unused&) = delete;
  /// Still so, and nobody waits to open it.
  [[nodiscard]] bool holds() const { return held_ && fcntl(file_, F_GETLEASE) == F_WRLCK; }

 private:
  int file_;
  bool held_ = false;
};

std::size_t remove_file(const fs::path& path) {
  std::error_code failed;
  return fs::remove(path, failed) ? 1 : 0;
}

/// That a segment is nobody's, or not there: its lock alone does not say so. Who was stopped for a
/// second between making the lock and taking it holds one that has no name.
bool is_free(const fs::path& segment) {
  if (!is_something(segment)) return true;
  return !is_squatted(segment) && Unused(segment).holds();
}

std::vector<std::string> names_in(const fs::path& directory) {
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator entry(directory, failed), end; !failed && entry != end;
       entry.increment(failed))
    names.push_back(entry->path().filename());
  return names;
}

/// A lock file is made before it is locked: a younger one may be of a process that starts.
bool older_than_a_second(const fs::path& path) {
  std::error_code failed;
  const auto written = fs::last_write_time(path, failed);
  return !failed && fs::file_time_type::clock::now() - written > std::chrono::seconds(1);
}

/// Removes a port if nobody listens at it (exclusive and shared lock) and nobody has it open. One
/// that a sender has open stays, so that no other listener gets its number: the sender would go on
/// writing into the removed file. A killed sender leaves no lock, only the file.
std::size_t remove_if_stale(const fs::path& port) {
  // Fast DDS opens a port while it holds this semaphore, so this comes first: whoever is about to
  // open the port has it open, or waits. To remove it under somebody's feet would let two make the
  // same port at once, each destroying what the other makes.
  const fs::path semaphore = port.parent_path() / ("sem." + port.filename().string() + "_mutex");
  std::optional<Unused> nobody_opens;
  if (is_something(semaphore)) nobody_opens.emplace(semaphore);
  if (nobody_opens && !nobody_opens->holds()) return 0;
  const Unused nobody_has(port);
  const fs::path exclusive_file = port.string() + "_el";
  const fs::path shared_file = port.string() + "_sl";
  std::optional<TryLock> exclusive, shared;
  if (is_something(exclusive_file)) exclusive.emplace(exclusive_file);
  if (is_something(shared_file)) shared.emplace(shared_file);
  if ((exclusive && !exclusive->held()) || (shared && !shared->held())) return 0;
  if (!exclusive && !shared && !older_than_a_second(port)) return 0;
  if (!nobody_has.holds()) return 0;
  const std::size_t removed =
      remove_file(port) + remove_file(shared_file) + remove_file(exclusive_file);
  return removed + (nobody_opens && nobody_opens->holds() ? remove_file(semaphore) : 0);
}

bool is_port(const std::string& name) {
  const std::string prefix = kPortPrefix;
  return name.starts_with(prefix) && name.size() > prefix.size() &&
         name.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

}  // namespace

std::optional<HeldFile> HeldFile::take(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
  if (file < 0) return std::nullopt;
  struct stat ours {
  }, there{};
  // Whoever held it may have removed it before it was locked here.
  if (fstat(file, &ours) == 0 && is_ours(ours) && flock(file, LOCK_EX | LOCK_NB) == 0 &&
      stat(path.c_str(), &there) == 0 && ours.st_ino == there.st_ino)
    return HeldFile(path, file);
  close(file);
  return std::nullopt;
}

HeldFile::~HeldFile() {
  if (file_ < 0) return;
  unlink(path_.c_str());
  close(file_);
}

HeldFile::HeldFile(HeldFile&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

HeldFile& HeldFile::operator=(HeldFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(file_, other.file_);
  return *this;
}

HeldFile mark_segments(const std::string& guid_prefix, const std::string& directory) {
  return HeldFile::take(directory + "/" + kLockPrefix + guid_prefix).value_or(HeldFile());
}

Result<ShmPort> claim_shm_port(const std::string& directory) {
  for (std::uint32_t i = 0; i < kPorts; ++i) {
    const std::string number = std::to_string(kFirstPort + i);
    const std::string path = directory + "/" + kClaimPrefix + number;
    const std::string port = directory + "/" + kPortPrefix + number;
    // Fast DDS could not open it, and would say nothing of it: nobody would be heard there.
    if (is_squatted(port) || is_squatted(port + "_el") || is_squatted(port + "_sl") ||
        is_squatted(directory + "/sem." + kPortPrefix + number + "_mutex"))
      continue;
    // Of a living process, or of a killed one. Who ended in an orderly way took the claim along,
    // and whoever still has the port open hears of its next listener.
    if (is_something(path) && is_something(port)) continue;
    if (auto claim = HeldFile::take(path)) return ShmPort{kFirstPort + i, std::move(*claim)};
  }
  return Error{ErrorCode::kResource, directory, "has no free port of shared memory",
               "end what is no longer needed, check that it is writable for this user, or set "
               "dds.shared_memory: false"};
}

bool is_port_open(std::uint32_t number, const std::string& directory) {
  const std::string port = directory + "/" + kPortPrefix + std::to_string(number);
  // Held by whoever listens; a killed listener's file is there, too.
  const int lock = open_ours(port + "_el", O_RDWR);
  if (lock < 0) return false;
  const bool held = flock(lock, LOCK_EX | LOCK_NB) != 0;
  close(lock);
  return held && is_something(port);
}

std::size_t remove_stale_segments(const std::string& directory) {
  const fs::path dir(directory);
  std::size_t removed = 0;
  const std::vector<std::string> names = names_in(dir);
  for (const std::string& name : names)  // first: a claim stays as long as its port does
    if (is_port(name)) removed += remove_if_stale(dir / name);
  for (const std::string& name : names) {
    if (!older_than_a_second(dir / name)) continue;
    if (name.starts_with(kLockPrefix)) {
      const TryLock lock(dir / name);
      if (!lock.held()) continue;
      const std::string prefix = name.substr(std::string(kLockPrefix).size());
      bool all_gone = true;
      for (const std::string& segment : names)
        if (segment.starts_with("fast_datasharing_" + prefix) && !is_squatted(dir / segment)) {
          const std::size_t gone = is_free(dir / segment) ? remove_file(dir / segment) : 0;
          removed += gone;
          all_gone &= gone > 0;
        }
      if (all_gone) removed += remove_file(dir / name);
    } else if (name.starts_with(kClaimPrefix)) {
      const std::string port = kPortPrefix + name.substr(std::string(kClaimPrefix).size());
      if (const TryLock lock(dir / name); lock.held() && !is_something(dir / port))
        removed += remove_file(dir / name);
    } else if (name.starts_with("fastrtps_") && !name.starts_with(kPortPrefix) &&
               name.ends_with("_el")) {
      const TryLock exclusive(dir / name);
      const fs::path segment = dir / name.substr(0, name.size() - 3);
      if (exclusive.held() && is_free(segment))
        removed += remove_file(segment) + remove_file(dir / name);
    }
  }
  return removed;
}

bool use_segment(const char* name, int file) {
  struct stat found {};
  const bool good = fstat(file, &found) == 0 && S_ISREG(found.st_mode) &&
                    (found.st_uid == geteuid() || found.st_uid == 0) &&
                    (found.st_mode & (S_IWGRP | S_IWOTH)) == 0;
  static std::atomic<std::uint64_t> refused{0};
  if (good) return true;
  if (const std::uint64_t n = ++refused; n == 1 || n % 1000 == 0)
    log_warning(std::string("shared memory: '") + name +
                "' is another user's, or others may write "
                "it: not opened (" +
                std::to_string(n) + " such so far)");
  return false;
}

std::uint64_t shared_memory_needed(const Settings& settings) {
  /// Nine frames and five clouds of full size in data-sharing pools.
  constexpr std::uint64_t kZeroCopyBytes = 88U << 20U;
  if (!settings.uses_shared_memory()) return 0;
  return (std::uint64_t(settings.shm_segment_mib) << 20U) +
         (zero_copy(settings) ? kZeroCopyBytes : 0);
}

Result<void> check_shared_memory(std::uint64_t needed, const std::string& directory) {
  struct statvfs stat {};
  if (statvfs(directory.c_str(), &stat) != 0)
    return Error{ErrorCode::kResource, directory, "is not there",
                 "mount a tmpfs, or set dds.shared_memory: false"};
  if (access(directory.c_str(), W_OK) != 0)
    return Error{ErrorCode::kResource, directory, "is not writable for this user",
                 "run as a user who may write it, or set dds.shared_memory: false"};
  if (stat.f_blocks == 0) return {};  // a tmpfs without a limit
  const std::uint64_t free_bytes = std::uint64_t(stat.f_bavail) * stat.f_frsize;
  if (free_bytes >= needed) return {};
  return Error{
      ErrorCode::kResource, directory,
      "has " + std::to_string(free_bytes >> 20U) + " MiB free, " + std::to_string(needed >> 20U) +
          " MiB are needed",
      "containers: --shm-size=1g; else enlarge the tmpfs, or set dds.shared_memory: false"};
}

}  // namespace crane::dds
