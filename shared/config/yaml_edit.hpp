// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"
#include "config/site_config.hpp"

namespace crane {

/// A site's file with other values: comments, order and whatever does not change stay as somebody
/// wrote them. What comes back reads as `wanted`; that is tested before it is returned.
/// In: the file's text, which read_site_config() accepts. A key that is not there yet is put first
/// in its section, a section that is not there last in the file. Error: Configuration when the text
/// is wrong, or when its shape does not let it be changed so (a list with more or fewer items, a
/// value by an alias).
Result<std::string> with_values(const std::string& text, const std::string& name,
                                const SiteConfig& wanted);

}  // namespace crane
