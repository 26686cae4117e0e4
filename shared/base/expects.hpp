#pragma once

#include <cstdio>
#include <cstdlib>

namespace crane {

/// A broken precondition is a bug of ours: say where and stop before harm is done.
/// (Compiler built-ins, because clang-tidy 14 does not know std::source_location.)
inline void expects(bool holds, const char* what, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) {
  if (holds) return;
  std::fprintf(stderr, "BUG %s:%d: expected: %s\n", file, line, what);
  std::abort();
}

}  // namespace crane
