// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace crane {

/// Progress of long work on stderr: a bar on a terminal, a plain line every two seconds elsewhere.
class Progress {
 public:
  explicit Progress(std::string title);
  /// `done` of `total` (0 = not known), and anything else worth a look.
  void update(std::size_t done, std::size_t total, const std::string& detail);
  /// Ends the line.
  void finish(const std::string& text);

 private:
  std::string title_;
  bool terminal_;
  std::chrono::steady_clock::time_point last_{};
  std::size_t last_done_ = 0;
};

}  // namespace crane
