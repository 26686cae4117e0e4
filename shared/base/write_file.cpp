#include "base/write_file.hpp"

#include <filesystem>
#include <fstream>

namespace crane {

Result<void> write_file(const std::string& path, const std::uint8_t* bytes, std::size_t size) {
  const std::string partial = path + ".part";
  std::ofstream file(partial, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  file.close();
  std::error_code failed;
  if (file) std::filesystem::rename(partial, path, failed);
  if (!file || failed) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    return Error{ErrorCode::kResource, path, "cannot be written",
                 "check permissions and free space"};
  }
  return {};
}

}  // namespace crane
