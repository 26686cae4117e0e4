// SPDX-License-Identifier: Apache-2.0
#include "base/format.hpp"

#include <cstdarg>
#include <cstdio>

namespace crane {

std::string formatted(const char* form, ...) {
  std::va_list values;
  va_start(values, form);
  std::va_list again;
  va_copy(again, values);
  const int size = std::vsnprintf(nullptr, 0, form, values);
  va_end(values);
  std::string out(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
  if (size > 0) std::vsnprintf(out.data(), out.size() + 1, form, again);
  va_end(again);
  return out;
}

}  // namespace crane
