// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/reference.hpp"

namespace crane {

/// Of an option that stands over a key of the configuration: the validator, CLI::Range, of what is
/// allowed there.
template <class Check, class Number>
Check within(const char* key, Number /*kind*/) {
  const Range range = range_of(key);
  return {static_cast<Number>(range.least), static_cast<Number>(range.most)};
}

}  // namespace crane
