#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace crane {

/// Writes beside the file and renames: it is there whole, or as it was before. Error: Resource.
Result<void> write_file(const std::string& path, const std::uint8_t* bytes, std::size_t size);

}  // namespace crane
