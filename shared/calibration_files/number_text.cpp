// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/number_text.hpp"

#include <charconv>

namespace crane {

std::string number_text(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string out(text, end);
  if (out.find_first_of(".en") == std::string::npos) out += ".0";
  return out;
}

std::string number_list(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += (out.empty() ? "" : ", ") + number_text(value);
  return out;
}

}  // namespace crane
