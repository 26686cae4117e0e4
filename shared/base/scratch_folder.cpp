// SPDX-License-Identifier: Apache-2.0
#include "base/scratch_folder.hpp"

#include <cstdlib>
#include <filesystem>

namespace crane {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const std::string& prefix) {
  std::error_code failed;
  std::string name = fs::temp_directory_path(failed) / (prefix + "XXXXXX");
  if (!failed && mkdtemp(name.data()) != nullptr) path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

}  // namespace crane
