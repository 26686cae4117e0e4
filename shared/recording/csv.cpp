// SPDX-License-Identifier: Apache-2.0
#include "recording/csv.hpp"

#include <charconv>
#include <sstream>

#include "base/read_file.hpp"

namespace crane {
namespace {
constexpr std::uintmax_t kMaxBytes = 256U << 20U;
}

Result<std::vector<std::pair<TimeNs, std::string>>> parse_time_csv(const std::string& text,
                                                                   const std::string& name) {
  std::vector<std::pair<TimeNs, std::string>> rows;
  std::istringstream lines(text);
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    const auto at = [&] { return name + ":" + std::to_string(number); };
    TimeNs time = 0;
    const auto [end, failed] = std::from_chars(line.data(), line.data() + line.size(), time);
    if (failed != std::errc() || end == line.data() + line.size() || *end != ',' || time <= 0)
      return Error{ErrorCode::kBadData, at(), "is not '<time in ns>,<value>'",
                   "write integer nanoseconds since 1970, a comma, the value"};
    if (!rows.empty() && time <= rows.back().first)
      return Error{ErrorCode::kBadData, at(),
                   "time does not increase (" + std::to_string(time) + " after " +
                       std::to_string(rows.back().first) + ")",
                   "sort the file and remove double lines"};
    rows.emplace_back(time, line.substr(static_cast<std::size_t>(end + 1 - line.data())));
  }
  return rows;
}

Result<std::vector<std::pair<TimeNs, std::string>>> read_time_csv(const std::string& path) {
  const auto text = read_file(path, kMaxBytes);
  if (text) return parse_time_csv(*text, path);
  if (text.error().code == ErrorCode::kNotAvailable)
    return Error{ErrorCode::kBadData, path, "no such file",
                 "a recording has data.csv in cam0, cam1, cart0 and trolley0"};
  return text.error();
}

}  // namespace crane
