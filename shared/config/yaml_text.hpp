// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane {

/// A YAML scalar that reads back as exactly this text.
std::string yaml_quoted(const std::string& text);
/// The shortest text that reads back as the same number.
std::string yaml_exact(double value);

}  // namespace crane
