// SPDX-License-Identifier: Apache-2.0
#include "gateway/height_files.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "gateway/json.hpp"

namespace crane::gateway {
namespace {

void add(std::string& out, double value, int decimals) {
  char text[48];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  out.append(text, end.ptr);
}

void add(std::string& out, std::uint64_t value) {
  out += std::to_string(value);
}

/// A list of what `say` adds of each cell.
template <class Say>
void add_list(std::string& out, const char* name, const client::HeightGrid& grid, const Say& say) {
  out += std::string(",\"") + name + "\":[";
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (i > 0) out += ',';
    say(grid.cells[i]);
  }
  out += ']';
}

double age_s(const client::Height& c, TimeNs now) {
  return std::max(0.0, double(now - c.last_observed_ns) * 1e-9);
}

}  // namespace

std::string heights_json(const client::HeightGrid& grid, const std::string& map, TimeNs now) {
  std::string out = "{\"map\":" + map + ",\"cell_m\":";
  add(out, grid.cell_m, 6);
  out += ",\"origin_x_m\":";
  add(out, grid.origin_x_m, 6);
  out += ",\"origin_y_m\":";
  add(out, grid.origin_y_m, 6);
  out += ",\"columns\":" + std::to_string(grid.columns) + ",\"rows\":" + std::to_string(grid.rows) +
         ",\"tiles_left_out\":" + std::to_string(grid.tiles_left_out);
  add_list(out, "surface", grid, [&](const client::Height& c) { add(out, int(c.surface)); });
  add_list(out, "height_m", grid, [&](const client::Height& c) {
    client::is_known(c.surface) ? add(out, c.height_m, 4) : void(out += "null");
  });
  add_list(out, "lower_bound", grid, [&](const client::Height& c) {
    out += client::is_known(c.surface) && c.lower_bound ? '1' : '0';
  });
  add_list(out, "views", grid, [&](const client::Height& c) { add(out, c.views); });
  add_list(out, "age_s", grid, [&](const client::Height& c) {
    c.last_observed_ns > 0 ? add(out, age_s(c, now), 0) : void(out += "null");
  });
  return out + "}\n";
}

std::string heights_csv(const client::HeightGrid& grid, TimeNs now) {
  std::string out = "x_m,y_m,surface,height_m,lower_bound,views,age_s\n";
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    const client::Height& c = grid.cells[i];
    if (c.surface == client::Surface::kUnknown) continue;
    add(out, grid.x_m(i), 4);
    out += ',';
    add(out, grid.y_m(i), 4);
    out += ',';
    out += surface_name(c.surface);
    out += ',';
    if (client::is_known(c.surface)) {
      add(out, c.height_m, 4);
      out += c.lower_bound ? ",1," : ",0,";
    } else {
      out += ",,";
    }
    add(out, c.views);
    out += ',';
    if (c.last_observed_ns > 0) add(out, age_s(c, now), 0);
    out += '\n';
  }
  return out;
}

Result<std::string> heights_png(const client::HeightGrid& grid) {
  const Error failed{ErrorCode::kResource, "heights.png", "cannot be made", ""};
  if (grid.cells.empty()) return Error{ErrorCode::kNotAvailable, "the map", "is empty", ""};
  try {
    cv::Mat image(int(grid.rows), int(grid.columns), CV_16UC1);
    for (std::uint32_t row = 0; row < grid.rows; ++row) {
      auto* line = image.ptr<std::uint16_t>(int(grid.rows - 1 - row));
      for (std::uint32_t x = 0; x < grid.columns; ++x) {
        const client::Height& c = grid.cells[std::size_t(row) * grid.columns + x];
        line[x] = client::is_known(c.surface) ? static_cast<std::uint16_t>(std::lround(
                                                    std::clamp(c.height_m * 1000, 0.0, 65'534.0)))
                                              : std::uint16_t{65'535};
      }
    }
    std::vector<unsigned char> bytes;
    if (!cv::imencode(".png", image, bytes)) return failed;
    return std::string(bytes.begin(), bytes.end());
  } catch (const cv::Exception&) {
    return failed;
  }
}

std::string heights_world_file(const client::HeightGrid& grid) {
  std::string out;
  const double top = grid.origin_y_m + (grid.rows - 0.5) * grid.cell_m;
  for (const double v :
       {grid.cell_m, 0.0, 0.0, -grid.cell_m, grid.origin_x_m + grid.cell_m / 2, top}) {
    add(out, v, 6);
    out += '\n';
  }
  return out;
}

}  // namespace crane::gateway
