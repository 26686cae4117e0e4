// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane {

/// Text as std::printf makes it, of any length.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* form, ...);

}  // namespace crane
