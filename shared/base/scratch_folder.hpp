// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane {

/// A folder of our own below the system's for temporary files, gone with the object.
class ScratchFolder {
 public:
  /// Its name is `prefix` and six more characters. path() is empty where none can be made.
  explicit ScratchFolder(const std::string& prefix);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace crane
