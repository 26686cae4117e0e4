// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/key_list.hpp"

namespace crane {

/// Every key there may be, with its default.
std::vector<KeyRow> all_keys();

/// What is allowed of a number, for an option of a command line that stands over it. `key` is one.
Range range_of(const std::string& key);

/// docs/configuration.md.
std::string reference_page();

/// In plain text: of a key ("mapper.voxel_m"), of a section with all it has ("mapper"), or, of an
/// empty name, of everything. Error: Configuration, with the key that may be meant.
Result<std::string> described(const std::string& name);

}  // namespace crane
