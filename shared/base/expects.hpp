// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace crane {

/// Where the last words of a process go; the log makes them its own.
inline std::atomic<void (*)(const char* line)>& last_words() {
  static std::atomic<void (*)(const char*)> say{[](const char* line) { std::fputs(line, stderr); }};
  return say;
}

/// A broken precondition is a bug of ours: say where and stop before harm is done.
/// (Compiler built-ins, because clang-tidy 14 does not know std::source_location.)
inline void expects(bool holds, const char* what, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) {
  if (holds) return;
  char text[512];
  std::snprintf(text, sizeof text, "BUG %s:%d: expected: %s\n", file, line, what);
  last_words().load()(text);
  std::abort();
}

}  // namespace crane
