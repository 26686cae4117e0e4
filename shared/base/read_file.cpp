// SPDX-License-Identifier: Apache-2.0
#include "base/read_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace crane {
namespace {

Error cannot_be_read(const std::string& path, int why) {
  return {ErrorCode::kResource, path, "cannot be read: " + std::generic_category().message(why),
          "check its permissions, those of the folders above it, and its disk"};
}

bool is_nothing(int why) {
  return why == ENOENT || why == ENOTDIR;
}

/// Its kind (st_mode); 0: nothing is there.
Result<mode_t> kind_of(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) == 0) return found.st_mode;
  if (is_nothing(errno)) return mode_t{0};
  return cannot_be_read(path, errno);
}

}  // namespace

Result<bool> is_there(const std::string& path) {
  const auto kind = kind_of(path);
  if (!kind) return kind.error();
  return *kind != 0;
}

Result<bool> is_folder(const std::string& path) {
  const auto kind = kind_of(path);
  if (!kind) return kind.error();
  return S_ISDIR(*kind);
}

Result<std::string> read_file(const std::string& path, std::uint64_t max_bytes) {
  // Without waiting for the other end of a FIFO, which is no regular file either.
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0 && is_nothing(errno))
    return Error{ErrorCode::kNotAvailable, path, "no such file", "check the path"};
  if (file < 0) return cannot_be_read(path, errno);
  struct stat found {};
  int failed = fstat(file, &found) == 0 ? 0 : errno;
  std::string bytes;
  const bool regular = S_ISREG(found.st_mode);
  bool too_large = regular && static_cast<std::uint64_t>(found.st_size) > max_bytes;
  if (failed == 0 && regular && !too_large) {
    // One byte more than it says: it may be growing.
    bytes.resize(static_cast<std::size_t>(found.st_size) + 1);
    std::size_t at = 0;
    while (at < bytes.size()) {
      const ssize_t got = read(file, bytes.data() + at, bytes.size() - at);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) failed = errno;
      if (got <= 0) break;
      at += static_cast<std::size_t>(got);
      if (at == bytes.size() && at <= max_bytes) bytes.resize(2 * at);
    }
    bytes.resize(at);
    too_large = at > max_bytes;
  }
  close(file);
  if (failed != 0) return cannot_be_read(path, failed);
  if (!regular) return Error{ErrorCode::kBadData, path, "is no file", "check the path"};
  if (too_large)
    return Error{ErrorCode::kBadData, path,
                 "is larger than " + std::to_string(max_bytes >> 20U) + " MiB",
                 "is this the right file?"};
  return bytes;
}

}  // namespace crane
