// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_text.hpp"

#include <array>
#include <charconv>

namespace crane {

std::string yaml_quoted(const std::string& text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const unsigned char c : text) {
    if (c == '"' || c == '\\')
      (out += '\\') += static_cast<char>(c);
    else if (c < 0x20 || c == 0x7F)
      ((out += "\\x") += kHex[c >> 4U]) += kHex[c & 15U];
    else
      out += static_cast<char>(c);
  }
  return out + '"';
}

std::string yaml_exact(double value) {
  std::array<char, 40> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace crane
