#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>
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
        if (segment.starts_with("fast_datasharing_" + prefix)) removed += remove_file(dir / segment);
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
  return removed;
}

Result<void> check_shared_memory(std::uint64_t needed, const std::string& directory) {
  struct statvfs stat {};
  if (statvfs(directory.c_str(), &stat) != 0)
    return Error{ErrorCode::kResource, directory, "is not there",
                 "mount a tmpfs, or set dds.transport: udp"};
  if (access(directory.c_str(), W_OK) != 0)
    return Error{ErrorCode::kResource, directory, "is not writable for this user",
                 "run as a user who may write it, or set dds.transport: udp"};
  const std::uint64_t free_bytes = std::uint64_t(stat.f_bavail) * stat.f_frsize;
  if (free_bytes >= needed) return {};
  return Error{ErrorCode::kResource, directory,
               "has " + std::to_string(free_bytes >> 20U) + " MiB free, " +
                   std::to_string(needed >> 20U) + " MiB are needed",
               "containers: --shm-size=512m; else enlarge the tmpfs, or set dds.transport: udp"};
}

Result<void> check_socket_buffers(std::uint32_t wanted) {
  for (const char* name : {"rmem_max", "wmem_max"}) {
    std::ifstream file(std::string("/proc/sys/net/core/") + name);
    std::uint64_t granted = 0;
    if (file >> granted && granted < wanted)
      return Error{ErrorCode::kResource, std::string("net.core.") + name,
                   std::to_string(granted) + " bytes, " + std::to_string(wanted) +
                       " wanted: large samples over UDP can be lost and sent again",
                   std::string("sysctl -w net.core.") + name + "=" + std::to_string(wanted)};
  }
  return {};
}

}  // namespace crane::dds
