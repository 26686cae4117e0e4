// SPDX-License-Identifier: Apache-2.0
#include "recording/hoist_csv.hpp"

#include <filesystem>

#include "base/read_file.hpp"
#include "config/yaml_strict.hpp"
#include "recording/csv.hpp"

namespace crane {
namespace {

Error bad_hoist(const std::string& path, TimeNs time, const std::string& text) {
  return {ErrorCode::kBadData, path,
          "'" + text + "' at time " + std::to_string(time) + " is no state of a hoist",
          "write hook height, sling, load x y z, load yaw, sway x y; sizes not negative"};
}

Result<std::vector<HoistReading>> to_readings(
    const Result<std::vector<std::pair<TimeNs, std::string>>>& rows, const std::string& path) {
  if (!rows) return rows.error();
  std::vector<HoistReading> out;
  for (const auto& [time, text] : *rows) {
    std::vector<double> v;
    for (std::size_t at = 0; at != std::string::npos;) {
      const std::size_t comma = text.find(',', at);
      const auto value = decimal_number(text.substr(at, comma - at));
      if (!value || v.size() == 8) return bad_hoist(path, time, text);
      v.push_back(*value);
      at = comma == std::string::npos ? comma : comma + 1;
    }
    v.resize(8);
    HoistReading r;
    r.time = time;
    r.hook_height_m = v[0];
    r.sling_m = v[1];
    r.load_size_m = {v[2], v[3], v[4]};
    r.load_yaw_rad = v[5];
    r.sway_m = {v[6], v[7]};
    if (r.sling_m < 0 || r.load_size_m.minCoeff() < 0) return bad_hoist(path, time, text);
    out.push_back(r);
  }
  return out;
}

}  // namespace

Result<std::vector<HoistReading>> parse_hoist_csv(const std::string& text,
                                                  const std::string& name) {
  return to_readings(parse_time_csv(text, name), name);
}

Result<std::vector<HoistReading>> read_hoist_csv(const std::string& path) {
  const auto there = is_there(path);
  if (!there) return there.error();
  if (!*there) return std::vector<HoistReading>{};
  return to_readings(read_time_csv(path), path);
}

}  // namespace crane
