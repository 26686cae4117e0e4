// SPDX-License-Identifier: Apache-2.0
#include "record_units.hpp"

#include <cstdio>
#include <map>
#include <optional>

#include "config/yaml_strict.hpp"

namespace crane {
namespace {

/// A number above 0 with a unit of the table.
std::optional<double> with_unit(const std::string& text, const std::map<std::string, double>& units,
                                double most) {
  const std::size_t end = text.find_first_not_of("0123456789.");
  const auto unit = units.find(end == std::string::npos ? "" : text.substr(end));
  const auto number = decimal_number(text.substr(0, end));
  if (unit == units.end() || !number || *number <= 0 || *number * unit->second > most)
    return std::nullopt;
  return *number * unit->second;
}

Error no_quantity(const std::string& option, const std::string& text, const char* example) {
  return {ErrorCode::kConfiguration, option, "'" + text + "' is not understood",
          std::string("for example ") + example};
}

}  // namespace

Result<double> parse_duration(const std::string& option, const std::string& text) {
  static const std::map<std::string, double> kUnits = {
      {"", 1}, {"s", 1}, {"min", 60}, {"m", 60}, {"h", 3600}};
  const auto seconds = with_unit(text, kUnits, 1e7);
  if (!seconds) return no_quantity(option, text, "60s, 10min or 2h");
  return *seconds;
}

Result<std::uint64_t> parse_size(const std::string& option, const std::string& text) {
  static const std::map<std::string, double> kUnits = {{"MB", 1e6},
                                                       {"GB", 1e9},
                                                       {"TB", 1e12},
                                                       {"MiB", double(1 << 20)},
                                                       {"GiB", double(1 << 30)},
                                                       {"TiB", 1024.0 * (1 << 30)}};
  const auto bytes = with_unit(text, kUnits, 1e15);
  if (!bytes) return no_quantity(option, text, "500MB, 20GB or 1TB");
  return static_cast<std::uint64_t>(*bytes);
}

std::string size_text(std::uint64_t bytes) {
  char text[32];
  const bool large = bytes >= 1'000'000'000;
  std::snprintf(text, sizeof text, large ? "%.1f GB" : "%.0f MB",
                double(bytes) / (large ? 1e9 : 1e6));
  return text;
}

}  // namespace crane
