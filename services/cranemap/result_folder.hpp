// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"

namespace crane {

/// The folder that a run writes into. A run touches only what a run made: it takes an empty folder,
/// or one that an earlier run marked, whose results it removes before it begins, so that nothing
/// old is taken for new. Held by one run at a time.
class ResultFolder {
 public:
  /// Error: Configuration when the folder is somebody else's or another run has it, Resource when
  /// it cannot be written.
  static Result<ResultFolder> claim(const std::string& path);
  ~ResultFolder();
  ResultFolder(ResultFolder&& other) noexcept;
  ResultFolder& operator=(ResultFolder&&) = delete;

  /// Where the services keep what they need to go on after a kill; gone with finish().
  [[nodiscard]] std::string state() const;
  /// All results are written: what is in state() from now on is no run's.
  void finish();

  static constexpr const char* kMarker = "cranemap_run.txt";
  /// What a run leaves behind, besides the marker and the logs.
  static constexpr const char* kResults[] = {"map.bt",          "map.ot",
                                             "map.pcd",         "height_map.png",
                                             "height_map.yaml", "height_map_view.png",
                                             "report.json",     "config.yaml"};

 private:
  ResultFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}
  bool write_marker(const char* state) const;

  std::string path_;
  int lock_ = -1;  ///< the marker, open and locked
};

}  // namespace crane
