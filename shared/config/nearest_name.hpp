// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

namespace crane {

/// The one of `names` that somebody who wrote `name` may have meant: the fewest letters to change,
/// put in or leave out (Levenshtein), a third of them at most, or the same beginning of five or
/// more. Empty: none is near.
std::string nearest_name(const std::string& name, const std::set<std::string>& names);

}  // namespace crane
