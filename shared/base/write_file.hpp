#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.hpp"

namespace crane {

/// Writes beside the file, as put_in_place() wants it. Error: Resource.
Result<void> write_file(const std::string& path, const std::uint8_t* bytes, std::size_t size);

/// Gives `partial`, written beside it, the name `path`: whole or as it was before, even when the
/// power fails now, and on disk when this returns. `partial` is gone either way. Error: Resource.
Result<void> put_in_place(const std::string& partial, const std::string& path);

}  // namespace crane
