#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace crane::dds {
namespace {

namespace fs = std::filesystem;
constexpr const char* kLockPrefix = "cranemap_lock_";

/// Holds a lock on a file if nobody else does.
class TryLock {
 public:
  explicit TryLock(const fs::path& path) : file_(open(path.c_str(), O_RDWR | O_CLOEXEC)) {
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

std::size_t remove_file(const fs::path& path) {
  std::error_code failed;
  return fs::remove(path, failed) ? 1 : 0;
}

std::vector<std::string> names_in(const fs::path& directory) {
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator entry(directory, failed), end; !failed && entry != end;
       entry.increment(failed))
    names.push_back(entry->path().filename());
  return names;
}

/// Files that some process we can see has mapped.
std::set<std::string> mapped_files(const std::string& directory) {
  std::set<std::string> mapped;
  for (const std::string& pid : names_in("/proc")) {
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream maps("/proc/" + pid + "/maps");
    for (std::string line; std::getline(maps, line);)
      if (const std::size_t at = line.find(directory + "/"); at != std::string::npos)
        mapped.insert(line.substr(at + directory.size() + 1));
  }
  return mapped;
}

bool older_than_a_second(const fs::path& path) {
  std::error_code failed;
  const auto written = fs::last_write_time(path, failed);
  return !failed && fs::file_time_type::clock::now() - written > std::chrono::seconds(1);
}

/// Ports without lock files: a listener's lock went with it, but a killed sender still counts as a
/// user of the port. Nobody has them open.
std::size_t remove_abandoned_ports(const fs::path& directory) {
  std::size_t removed = 0;
  std::optional<std::set<std::string>> mapped;
  for (const std::string& name : names_in(directory)) {
    if (!name.starts_with("fastrtps_port") || name.ends_with("_el") || name.ends_with("_sl") ||
        fs::exists(directory / (name + "_el")) || fs::exists(directory / (name + "_sl")) ||
        !older_than_a_second(directory / name))
      continue;
    if (!mapped) mapped = mapped_files(directory);
    if (mapped->contains(name)) continue;
    removed += remove_file(directory / name) + remove_file(directory / ("sem." + name + "_mutex"));
  }
  return removed;
}

}  // namespace

SegmentLock::SegmentLock(const std::string& guid_prefix, const std::string& directory)
    : path_(directory + "/" + kLockPrefix + guid_prefix),
      file_(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (file_ >= 0) flock(file_, LOCK_EX | LOCK_NB);
}

SegmentLock::~SegmentLock() {
  if (file_ < 0) return;
  unlink(path_.c_str());
  close(file_);
}

SegmentLock::SegmentLock(SegmentLock&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

SegmentLock& SegmentLock::operator=(SegmentLock&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(file_, other.file_);
  return *this;
}

std::size_t remove_stale_segments(const std::string& directory) {
  const fs::path dir(directory);
  const std::vector<std::string> names = names_in(dir);
  std::size_t removed = 0;
  for (const std::string& name : names) {
    if (name.starts_with(kLockPrefix)) {
      const TryLock lock(dir / name);
      if (!lock.held()) continue;
      const std::string prefix = name.substr(std::string(kLockPrefix).size());
      for (const std::string& segment : names)
        if (segment.starts_with("fast_datasharing_" + prefix))
          removed += remove_file(dir / segment);
      removed += remove_file(dir / name);
    } else if (name.starts_with("fastrtps_port") && name.ends_with("_el")) {
      // A port belongs to whoever listens (exclusive lock) and to all that send (shared lock).
      const std::string port = name.substr(0, name.size() - 3);
      const TryLock exclusive(dir / name);
      const fs::path shared_file = dir / (port + "_sl");
      std::optional<TryLock> shared;
      if (fs::exists(shared_file)) shared.emplace(shared_file);
      if (!exclusive.held() || (shared && !shared->held())) continue;
      removed += remove_file(dir / port) + remove_file(dir / ("sem." + port + "_mutex")) +
                 remove_file(shared_file) + remove_file(dir / name);
    } else if (name.starts_with("fastrtps_") && name.ends_with("_el")) {
      const TryLock exclusive(dir / name);
      if (!exclusive.held()) continue;
      removed += remove_file(dir / name.substr(0, name.size() - 3)) + remove_file(dir / name);
    }
  }
  return removed + remove_abandoned_ports(dir);
}

std::uint64_t shared_memory_needed(const Settings& settings) {
  /// Nine frames and five clouds of full size in data-sharing pools.
  constexpr std::uint64_t kZeroCopyBytes = 88U << 20U;
  if (settings.transport == Transport::kUdp) return 0;
  return settings.shm_segment_bytes + (zero_copy(settings) ? kZeroCopyBytes : 0);
}

Result<void> check_shared_memory(std::uint64_t needed, const std::string& directory) {
  struct statvfs stat {};
  if (statvfs(directory.c_str(), &stat) != 0)
    return Error{ErrorCode::kResource, directory, "is not there",
                 "mount a tmpfs, or set dds.shared_memory: false"};
  if (access(directory.c_str(), W_OK) != 0)
    return Error{ErrorCode::kResource, directory, "is not writable for this user",
                 "run as a user who may write it, or set dds.shared_memory: false"};
  const std::uint64_t free_bytes = std::uint64_t(stat.f_bavail) * stat.f_frsize;
  if (free_bytes >= needed) return {};
  return Error{
      ErrorCode::kResource, directory,
      "has " + std::to_string(free_bytes >> 20U) + " MiB free, " + std::to_string(needed >> 20U) +
          " MiB are needed",
      "containers: --shm-size=512m; else enlarge the tmpfs, or set dds.shared_memory: false"};
}

}  // namespace crane::dds
