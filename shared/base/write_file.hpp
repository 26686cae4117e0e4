// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// Writes beside the file, as put_in_place() wants it. Error: Resource.
Result<void> write_file(const std::string& path, const std::uint8_t* bytes, std::size_t size);

/// A file's name in its folder, and its content.
using NamedBytes = std::pair<std::string, std::vector<std::uint8_t>>;

/// Several files of one folder, in this order, each as write_file() does; on disk when all are.
/// Error: Resource; those before it are in place then.
Result<void> write_files(const std::string& folder, const std::vector<NamedBytes>& files);

/// Gives `partial`, written beside it, the name `path`: whole or as it was before, even when the
/// power fails now, and on disk when this returns. `partial` is gone either way. Error: Resource.
Result<void> put_in_place(const std::string& partial, const std::string& path);

}  // namespace crane
