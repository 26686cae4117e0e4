// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane {

/// The shortest decimal text that reads back as just this number, with a point whatever the locale,
/// and never as a whole number: OpenCV tells 1 from 1.0.
std::string number_text(double value);
/// Apart by ", ".
std::string number_list(const std::vector<double>& values);

}  // namespace crane
