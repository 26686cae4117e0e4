// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "gateway/foxglove_json.hpp"

namespace crane::gateway::foxglove {
namespace {

void put(std::string& data, float value) {
  data.append(reinterpret_cast<const char*>(&value), 4);
}

}  // namespace

std::string frame_transforms(TimeNs time, const std::vector<Transform>& transforms) {
  Json all = Json::array();
  for (const Transform& t : transforms)
    all.push_back({{"timestamp", stamp(time)},
                   {"parent_frame_id", t.parent},
                   {"child_frame_id", t.child},
                   {"translation", xyz(t.T_parent_child.translation())},
                   {"rotation", xyzw(Eigen::Quaterniond(t.T_parent_child.rotation()))}});
  return text_of({{"transforms", std::move(all)}});
}

std::string log_line(TimeNs time, Level level, const std::string& name,
                     const std::string& message) {
  return text_of({{"timestamp", stamp(time)},
                  {"level", int(level)},
                  {"message", message},
                  {"name", name},
                  {"file", ""},
                  {"line", 0}});
}

std::string point_cloud(const dds::PartialCloud& c, std::size_t most) {
  const std::size_t pixels = std::size_t(c.width()) * c.height();
  std::uint32_t step = 1;
  while (pixels / step / step > most) ++step;
  Eigen::Matrix3d R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = c.rotation()[static_cast<std::size_t>(i)];
  const bool colour = c.has_colour() == 1;
  const std::size_t stride = colour ? 17 : 13;
  std::string data;
  data.reserve(std::min(most, pixels) * stride);
  for (std::uint32_t v = step / 2; v < c.height(); v += step)
    for (std::uint32_t u = step / 2; u < c.width(); u += step) {
      const std::size_t at = std::size_t(v) * c.width() + u;
      const double z = c.depth()[at];
      if (!(z > 0) || data.size() + stride > most * stride) continue;
      const Eigen::Vector3d p =
          R * Eigen::Vector3d((u - c.cx_px()) / c.f_px() * z, (v - c.cy_px()) / c.f_px() * z, z);
      for (const double x : {p.x(), p.y(), p.z()}) put(data, static_cast<float>(x));
      data += static_cast<char>(c.confidence()[at]);
      if (!colour) continue;
      for (const std::size_t i : {2, 1, 0}) data += static_cast<char>(c.colour()[3 * at + i]);
      data += static_cast<char>(255);
    }
  Json fields = {field("x", 0, kFloat32), field("y", 4, kFloat32), field("z", 8, kFloat32),
                 field("confidence", 12, kUint8)};
  if (colour)
    for (int i = 0; i < 4; ++i)
      fields.push_back(
          field(std::array{"red", "green", "blue", "alpha"}[std::size_t(i)], 13 + i, kUint8));
  return with_data({{"timestamp", stamp(c.exposure_time_ns())},
                    {"frame_id", "camera"},
                    {"pose", pose_at({0, 0, 0})},
                    {"point_stride", stride},
                    {"fields", std::move(fields)}},
                   data);
}

std::string grid(const client::HeightGrid& g, TimeNs time, std::size_t most) {
  std::uint32_t n = 1;
  const auto parts = [&n](std::uint32_t cells) { return (cells + n - 1) / n; };
  while (std::size_t(parts(g.columns)) * parts(g.rows) > most) ++n;
  const std::uint32_t columns = parts(g.columns), rows = parts(g.rows);
  constexpr std::size_t kStride = 6;
  std::string data;
  data.reserve(std::size_t(columns) * rows * kStride);
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      float height = std::numeric_limits<float>::quiet_NaN();
      client::Surface surface = client::Surface::kUnknown;
      bool lower_bound = false, all_known = true;
      for (std::uint32_t y = row * n; y < std::min(g.rows, (row + 1) * n); ++y)
        for (std::uint32_t x = column * n; x < std::min(g.columns, (column + 1) * n); ++x) {
          const client::Height& cell = g.cells[std::size_t(y) * g.columns + x];
          if (!client::is_known(cell.surface)) {
            all_known = false;
            if (!client::is_known(surface)) surface = std::max(surface, cell.surface);
            continue;
          }
          lower_bound = lower_bound || cell.lower_bound;
          if (height >= static_cast<float>(cell.height_m)) continue;
          height = static_cast<float>(cell.height_m);
          surface = cell.surface;
        }
      put(data, height);
      data += static_cast<char>(surface);
      data += static_cast<char>(client::is_known(surface) && (lower_bound || !all_known) ? 1 : 0);
    }
  return with_data({{"timestamp", stamp(time)},
                    {"frame_id", "map"},
                    {"pose", pose_at({g.origin_x_m, g.origin_y_m, 0})},
                    {"column_count", columns},
                    {"cell_size", {{"x", g.cell_m * n}, {"y", g.cell_m * n}}},
                    {"row_stride", columns * kStride},
                    {"cell_stride", kStride},
                    {"fields",
                     {field("height", 0, kFloat32), field("surface", 4, kUint8),
                      field("lower_bound", 5, kUint8)}}},
                   data);
}

}  // namespace crane::gateway::foxglove
