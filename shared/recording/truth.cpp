// SPDX-License-Identifier: Apache-2.0
#include "recording/truth.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "config/yaml_reader.hpp"

namespace crane {
namespace {

std::string geometry_file(const std::string& png_path) {
  return std::filesystem::path(png_path).replace_extension(".yaml");
}

Error disk_error(const std::string& path) {
  return {ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

}  // namespace

Result<HeightMap> read_height_map(const std::string& png_path) {
  auto y = YamlReader::from_file(geometry_file(png_path));
  if (!y) return y.error();
  HeightMap map;
  std::vector<double> origin;
  std::vector<double> size;
  y->number("cell_m", map.cell_m, 1e-4, 100, true);
  y->numbers("origin_m", origin, 2, true);
  y->numbers("size", size, 2, true);
  y->number("offset_m", map.offset_m, -100, 100);
  if (auto done = y->finish(); !done) return done.error();
  cv::Mat image;
  try {
    image = cv::imread(png_path, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty() || image.type() != CV_16UC1)
    return Error{ErrorCode::kBadData, png_path, "is no 16-bit grey PNG", "heights are millimetres"};
  if (image.cols != static_cast<int>(size[0]) || image.rows != static_cast<int>(size[1]))
    return Error{ErrorCode::kWrongSize, png_path, "has another size than its .yaml says", ""};
  map.origin_x_m = origin[0];
  map.origin_y_m = origin[1];
  map.columns = static_cast<std::uint32_t>(image.cols);
  map.rows = static_cast<std::uint32_t>(image.rows);
  map.height_mm.assign(image.begin<std::uint16_t>(), image.end<std::uint16_t>());
  return map;
}

Result<void> write_height_map(const std::string& png_path, const HeightMap& map) {
  const cv::Mat image(static_cast<int>(map.rows), static_cast<int>(map.columns), CV_16UC1,
                      const_cast<std::uint16_t*>(map.height_mm.data()));
  bool written = false;
  try {
    written = cv::imwrite(png_path, image);
  } catch (const cv::Exception&) {
    written = false;
  }
  std::ofstream geometry(geometry_file(png_path));
  geometry
      << "# 16-bit PNG, millimetres above the floor, 65535 = never seen; row 0 is the lowest y, "
         "column 0 the lowest x\ncell_m: "
      << map.cell_m << "\norigin_m: [" << map.origin_x_m << ", " << map.origin_y_m << "]\nsize: ["
      << map.columns << ", " << map.rows << "] # columns (x), rows (y)\n";
  if (map.offset_m != 0)
    geometry << "offset_m: " << map.offset_m << " # height of value 0: pits lie below the floor\n";
  geometry.close();
  if (!written || !geometry) return disk_error(png_path);
  return {};
}

Result<std::vector<TrueObstacle>> read_obstacles(const std::string& path) {
  auto y = YamlReader::from_file(path);
  if (!y) return y.error();
  std::vector<TrueObstacle> out;
  for (YamlReader& item : y->items("obstacles")) {
    TrueObstacle o;
    std::vector<double> size = {0, 0};
    item.text("name", o.name, true);
    item.text("kind", o.kind);
    item.number("x", o.x_m, -1e5, 1e5, true);
    item.number("y", o.y_m, -1e5, 1e5, true);
    item.number("height", o.height_m, 0, 1000, true);
    item.number("seat_height", o.seat_height_m, 0, 1000);
    item.number("radius", o.radius_m, 0, 1000);
    item.numbers("size", size, 2);
    item.number("yaw", o.yaw_rad, -10, 10);
    item.number("length", o.length_m, 0, 1000);
    item.number("base", o.base_m, -100, 1000);
    item.number("low", o.low_m, -100, 1000);
    item.number("sag", o.sag_m, 0, 1000);
    std::vector<double> from = {0, 0, 0}, to = {0, 0, 0};
    item.numbers("from", from, 3);
    item.numbers("to", to, 3);
    std::copy(from.begin(), from.end(), o.from_m.begin());
    std::copy(to.begin(), to.end(), o.to_m.begin());
    o.size_x_m = size[0];
    o.size_y_m = size[1];
    out.push_back(o);
  }
  if (auto done = y->finish(); !done) return done.error();
  return out;
}

Result<void> write_obstacles(const std::string& path, const std::vector<TrueObstacle>& obstacles) {
  std::ostringstream s;
  s << "# true obstacles; x, y: centre of the footprint, height: highest point above the floor; "
       "metres, radians\nobstacles:\n";
  for (const TrueObstacle& o : obstacles) {
    s << "  - {name: '" << o.name << "', kind: '" << o.kind << "', x: " << o.x_m << ", y: " << o.y_m
      << ", height: " << o.height_m;
    if (o.seat_height_m > 0) s << ", seat_height: " << o.seat_height_m;
    if (o.radius_m > 0) s << ", radius: " << o.radius_m;
    if (o.length_m > 0) s << ", length: " << o.length_m;
    if (o.size_x_m > 0) s << ", size: [" << o.size_x_m << ", " << o.size_y_m << "]";
    if (std::isfinite(o.base_m)) s << ", base: " << o.base_m;
    if (o.low_m > 0) s << ", low: " << o.low_m;
    if (o.sag_m > 0) s << ", sag: " << o.sag_m;
    const auto point = [](const std::array<double, 3>& p) {
      std::ostringstream out;
      out << "[" << p[0] << ", " << p[1] << ", " << p[2] << "]";
      return out.str();
    };
    if (o.is_line()) s << ", from: " << point(o.from_m) << ", to: " << point(o.to_m);
    s << ", yaw: " << o.yaw_rad << "}\n";
  }
  std::ofstream file(path);
  file << s.str();
  file.close();
  if (!file) return disk_error(path);
  return {};
}

}  // namespace crane
