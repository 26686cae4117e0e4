#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
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
constexpr const char* kClaimPrefix = "cranemap_port_";
constexpr const char* kPortPrefix = "fastrtps_port";
/// Beyond those that Fast DDS reckons from domain and participant.
constexpr std::uint32_t kFirstPort = 1'000'000;
constexpr std::uint32_t kPorts = 4096;

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

/// Ports that nobody listens at (exclusive and shared lock) and nobody has open. One that a sender
/// has open stays, so that no other listener gets its number: the sender would go on writing into
/// the removed file. A killed sender leaves no lock, only the file.
std::size_t remove_stale_ports(const fs::path& directory) {
  std::size_t removed = 0;
  std::optional<std::set<std::string>> mapped;
  for (const std::string& name : names_in(directory)) {
    if (!name.starts_with(kPortPrefix) || name.ends_with("_el") || name.ends_with("_sl")) continue;
    const fs::path exclusive_file = directory / (name + "_el");
    const fs::path shared_file = directory / (name + "_sl");
    std::optional<TryLock> exclusive, shared;
    if (fs::exists(exclusive_file)) exclusive.emplace(exclusive_file);
    if (fs::exists(shared_file)) shared.emplace(shared_file);
    if ((exclusive && !exclusive->held()) || (shared && !shared->held())) continue;
    if (!exclusive && !shared && !older_than_a_second(directory / name)) continue;
    if (!mapped) mapped = mapped_files(directory);
    if (mapped->contains(name)) continue;
    removed += remove_file(directory / name) + remove_file(directory / ("sem." + name + "_mutex")) +
               remove_file(shared_file) + remove_file(exclusive_file);
  }
  return removed;
}

}  // namespace

std::optional<HeldFile> HeldFile::take(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return std::nullopt;
  struct stat ours {
  }, there{};
  // Whoever held it may have removed it before it was locked here.
  if (flock(file, LOCK_EX | LOCK_NB) == 0 && fstat(file, &ours) == 0 &&
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
    // Of a living process, or of a killed one. Who ended in an orderly way took the claim along,
    // and whoever still has the port open hears of its next listener.
    if (fs::exists(path) && fs::exists(directory + "/" + kPortPrefix + number)) continue;
    if (auto claim = HeldFile::take(path)) return ShmPort{kFirstPort + i, std::move(*claim)};
  }
  return Error{ErrorCode::kResource, directory, "has no free port of shared memory",
               "end what is no longer needed, check that it is writable for this user, or set "
               "dds.shared_memory: false"};
}

std::size_t remove_stale_segments(const std::string& directory) {
  const fs::path dir(directory);
  std::size_t removed = remove_stale_ports(dir);  // first: a claim stays as long as its port does
  const std::vector<std::string> names = names_in(dir);
  for (const std::string& name : names) {
    if (name.starts_with(kLockPrefix)) {
      const TryLock lock(dir / name);
      if (!lock.held()) continue;
      const std::string prefix = name.substr(std::string(kLockPrefix).size());
      for (const std::string& segment : names)
        if (segment.starts_with("fast_datasharing_" + prefix))
          removed += remove_file(dir / segment);
      removed += remove_file(dir / name);
    } else if (name.starts_with(kClaimPrefix)) {
      const std::string port = kPortPrefix + name.substr(std::string(kClaimPrefix).size());
      if (const TryLock lock(dir / name); lock.held() && !fs::exists(dir / port))
        removed += remove_file(dir / name);
    } else if (name.starts_with("fastrtps_") && !name.starts_with(kPortPrefix) &&
               name.ends_with("_el")) {
      const TryLock exclusive(dir / name);
      if (!exclusive.held()) continue;
      removed += remove_file(dir / name.substr(0, name.size() - 3)) + remove_file(dir / name);
    }
  }
  return removed;
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
