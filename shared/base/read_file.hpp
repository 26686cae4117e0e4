// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace crane {

// std::filesystem's short forms throw where a folder may not be entered; these say so.

/// Whether something is at the path; a link that leads nowhere is nothing.
/// Error: Resource when that cannot be told, e.g. a folder above it may not be entered.
Result<bool> is_there(const std::string& path);

/// Whether a folder is at the path. Error: as is_there().
Result<bool> is_folder(const std::string& path);

/// All of a regular file. Error: NotAvailable when there is none, BadData when it is something else
/// or has more than `max_bytes`, Resource when it cannot be read.
Result<std::string> read_file(const std::string& path, std::uint64_t max_bytes);

}  // namespace crane
