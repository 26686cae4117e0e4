// SPDX-License-Identifier: Apache-2.0
#include "base/write_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace crane {
namespace {

namespace fs = std::filesystem;

/// Waits until what is written of a file, or the names in a folder, are on disk.
bool sync_to_disk(const fs::path& path, int flags) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | flags);
  if (file < 0) return false;
  // Some file systems cannot sync a folder: they have nothing to wait for.
  const bool synced = fsync(file) == 0 || errno == EINVAL;
  const int why = errno;
  close(file);
  errno = why;
  return synced;
}

Error cannot_write(const std::string& partial, const std::string& path, int why) {
  std::error_code ignored;
  fs::remove(partial, ignored);
  return {ErrorCode::kResource, path, "cannot be written: " + std::generic_category().message(why),
          "check permissions and free space"};
}

/// Its content is on disk, its name will be with the folder.
Result<void> replace(const std::string& partial, const std::string& path) {
  if (!sync_to_disk(partial, 0) || std::rename(partial.c_str(), path.c_str()) != 0)
    return cannot_write(partial, path, errno);
  return {};
}

Result<void> write_partial(const std::string& partial, const std::string& path,
                           const std::uint8_t* bytes, std::size_t size) {
  errno = 0;
  std::ofstream file(partial, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  file.close();
  if (!file) return cannot_write(partial, path, errno != 0 ? errno : EIO);
  return {};
}

}  // namespace

Result<void> write_file(const std::string& path, const std::uint8_t* bytes, std::size_t size) {
  const std::string partial = path + ".part";
  if (auto written = write_partial(partial, path, bytes, size); !written) return written;
  return put_in_place(partial, path);
}

Result<void> write_files(const std::string& folder, const std::vector<NamedBytes>& files) {
  for (const auto& [name, bytes] : files) {
    const std::string path = (fs::path(folder) / name).string();
    const std::string partial = path + ".part";
    if (auto written = write_partial(partial, path, bytes.data(), bytes.size()); !written)
      return written;
    if (auto replaced = replace(partial, path); !replaced) return replaced;
  }
  if (!sync_to_disk(folder, O_DIRECTORY)) return cannot_write("", folder, errno);
  return {};
}

Result<void> put_in_place(const std::string& partial, const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  if (auto replaced = replace(partial, path); !replaced) return replaced;
  if (!sync_to_disk(folder.empty() ? fs::path(".") : folder, O_DIRECTORY))
    return cannot_write(partial, path, errno);
  return {};
}

}  // namespace crane
