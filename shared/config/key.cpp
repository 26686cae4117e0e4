// SPDX-License-Identifier: Apache-2.0
#include "config/key.hpp"

#include <array>
#include <utility>

namespace crane {
namespace {

/// Names carry their unit.
std::string unit_of(const std::string& name) {
  static constexpr std::array<std::pair<const char*, const char*>, 11> kEndings = {{
      {"_mps", "m/s"},
      {"_ms", "ms"},
      {"_m", "m"},
      {"_s", "s"},
      {"_hz", "Hz"},
      {"_deg", "deg"},
      {"_px", "px"},
      {"_percent", "%"},
      {"_mib", "MiB"},
      {"_kib", "KiB"},
      {"_100us", "100 us"},
  }};
  for (const auto& [ending, unit] : kEndings)
    if (name.ends_with(ending)) return unit;
  return "";
}

}  // namespace

Key::Key(const char* called, const char* says) : name(called), text(says), unit(unit_of(name)) {}

Key Key::in(const char* unit_of_it) const {
  Key key = *this;
  key.unit = unit_of_it;
  return key;
}

Key Key::required() const {
  Key key = *this;
  key.is_required = true;
  return key;
}

Key Key::by_default(const char* words) const {
  Key key = *this;
  key.default_words = words;
  return key;
}

Key Key::on_one_line() const {
  Key key = *this;
  key.one_line = true;
  return key;
}

}  // namespace crane
