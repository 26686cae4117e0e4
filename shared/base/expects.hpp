#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace crane {

/// A broken precondition is a bug of ours: say where and stop before harm is done.
inline void expects(bool holds, const char* what,
                    std::source_location at = std::source_location::current()) {
  if (holds) return;
  std::fprintf(stderr, "BUG %s:%u: expected: %s\n", at.file_name(), at.line(), what);
  std::abort();
}

}  // namespace crane
