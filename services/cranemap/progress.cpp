// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include <unistd.h>

#include <cstdio>

namespace crane {

using namespace std::chrono_literals;

Progress::Progress(std::string title) : title_(std::move(title)), terminal_(isatty(2) != 0) {}

void Progress::update(std::size_t done, std::size_t total, const std::string& detail) {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < (terminal_ ? 100ms : 2000ms) && !(done == total && done != last_done_)) return;
  last_ = now;
  last_done_ = done;
  const std::string of = total > 0 ? "/" + std::to_string(total) : "";
  if (!terminal_) {
    std::fprintf(stderr, "%s %zu%s %s\n", title_.c_str(), done, of.c_str(), detail.c_str());
    return;
  }
  constexpr std::size_t kWidth = 28;
  const std::size_t filled = total > 0 ? kWidth * done / total : 0;
  std::string bar(filled, '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r%s [%s] %zu%s %s\x1b[K", title_.c_str(), bar.c_str(), done, of.c_str(),
               detail.c_str());
  std::fflush(stderr);
}

void Progress::finish(const std::string& text) {
  std::fprintf(stderr, "%s%s%s\n", terminal_ ? "\r" : "", text.c_str(), terminal_ ? "\x1b[K" : "");
}

}  // namespace crane
