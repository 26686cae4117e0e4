// SPDX-License-Identifier: Apache-2.0
#include "ros2_messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "bounds.h"
#include "imaging/convert.hpp"
#include "map_codec/compression.hpp"
#include "map_codec/crc32c.hpp"
#include "service/service_name.hpp"

namespace crane::ros2 {
namespace {

namespace sm = sensor_msgs::msg::dds_;
constexpr std::uint8_t kFloat32 = 7;  // sensor_msgs/PointField

std_msgs::msg::dds_::Header_ header(TimeNs time, const std::string& frame) {
  std_msgs::msg::dds_::Header_ h;
  h.stamp().sec(static_cast<std::int32_t>(time / kNsPerSecond));
  h.stamp().nanosec(static_cast<std::uint32_t>(time % kNsPerSecond));
  h.frame_id(frame);
  return h;
}

/// Little-endian x, y, z and what else the fields say, four bytes each.
sm::PointCloud2_ empty_cloud(TimeNs time, const std::string& frame,
                             const std::vector<std::string>& fields) {
  sm::PointCloud2_ m;
  m.header(header(time, frame));
  for (std::size_t i = 0; i < fields.size(); ++i) {
    sm::PointField_ f;
    f.name(fields[i]);
    f.offset(static_cast<std::uint32_t>(4 * i));
    f.datatype(kFloat32);
    f.count(1);
    m.fields().push_back(f);
  }
  m.is_bigendian(false);
  m.point_step(static_cast<std::uint32_t>(4 * fields.size()));
  return m;
}

void put(std::vector<std::uint8_t>& data, float value) {
  std::uint8_t bytes[4];
  std::memcpy(bytes, &value, 4);
  data.insert(data.end(), bytes, bytes + 4);
}

diagnostic_msgs::msg::dds_::KeyValue_ pair(const std::string& key, const std::string& value) {
  diagnostic_msgs::msg::dds_::KeyValue_ kv;
  kv.key(key);
  kv.value(value);
  return kv;
}

// diagnostic_msgs/DiagnosticStatus: OK, WARN, ERROR, as our STATUS_OK, DEGRADED, FAILED.
static_assert(v1::STATUS_OK == 0 && v1::STATUS_DEGRADED == 1 && v1::STATUS_FAILED == 2);

}  // namespace

Frames::Frames(std::uint32_t crane) {
  const std::string prefix = "crane_" + std::to_string(crane) + "/";
  gantry = prefix + "gantry";
  camera = prefix + "camera";
  camera_rectified = prefix + "camera_rectified";
}

sm::PointCloud2_ point_cloud(const dds::PartialCloud& c, std::uint32_t step, const Frames& frames) {
  sm::PointCloud2_ m =
      empty_cloud(c.exposure_time_ns(), frames.camera_rectified, {"x", "y", "z", "rgb"});
  m.height(c.height() / step);
  m.width(c.width() / step);
  m.row_step(m.width() * m.point_step());
  m.is_dense(false);
  m.data().reserve(std::size_t(m.row_step()) * m.height());
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (std::uint32_t v = 0; v < m.height(); ++v)
    for (std::uint32_t u = 0; u < m.width(); ++u) {
      const std::size_t at = std::size_t(v * step) * c.width() + u * step;
      const float z = c.depth()[at] > 0 ? c.depth()[at] : kNan;
      put(m.data(), static_cast<float>((u * step - c.cx_px()) / c.f_px()) * z);
      put(m.data(), static_cast<float>((v * step - c.cy_px()) / c.f_px()) * z);
      put(m.data(), z);
      std::uint32_t rgb = 0x808080;
      if (c.has_colour() == 1)
        rgb = std::uint32_t(c.colour()[3 * at + 2]) << 16U |
              std::uint32_t(c.colour()[3 * at + 1]) << 8U | c.colour()[3 * at];
      float packed = 0;
      std::memcpy(&packed, &rgb, 4);
      put(m.data(), packed);
    }
  return m;
}

Result<sm::Image_> image(const dds::StereoFrame& f, const Frames& frames) {
  const auto format = pixel_format(f.encoding());
  if (!format) return Error{ErrorCode::kBadData, "stereo_frame", "unknown encoding", ""};
  sm::Image_ m;
  m.header(header(f.exposure_time_ns(), frames.camera));
  m.height(f.height());
  m.width(f.width());
  m.is_bigendian(0);
  // ROS has our names for what it has (and two for YUV 4:2:2); the rest becomes what it has.
  const std::uint32_t pixel = bytes_per_pixel(*format);
  m.encoding(*format == PixelFormat::kYuyv ? "yuv422_yuy2" : name_of(*format));
  if (pixel != 0) {
    m.step(f.width() * pixel);
    m.data().assign(f.left().begin(), f.left().begin() + std::size_t{m.step()} * f.height());
    return m;
  }
  auto converted = to_image({*format, f.width(), f.height(), {f.left().data(), f.left().size()}});
  if (!converted) return converted.error();
  m.encoding(name_of(format_of_channels(converted->channels)));
  m.step(f.width() * converted->channels);
  m.data(std::move(converted->bytes));
  return m;
}

sm::CameraInfo_ camera_info(const CameraModel& c, TimeNs time, const Frames& frames) {
  sm::CameraInfo_ m;
  m.header(header(time, frames.camera));
  m.height(c.height);
  m.width(c.width);
  switch (c.lens) {
    case LensModel::kRadialTangential:
      m.distortion_model("plumb_bob");
      m.d({c.k1, c.k2, c.p1, c.p2, c.k3});
      break;
    case LensModel::kRational:
      m.distortion_model("rational_polynomial");
      m.d({c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6});
      break;
    case LensModel::kEquidistant:
      m.distortion_model("equidistant");
      m.d({c.k1, c.k2, c.k3, c.k4});
      break;
  }
  m.k({c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1});
  m.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
  m.p({c.fx_px, 0, c.cx_px, 0, 0, c.fy_px, c.cy_px, 0, 0, 0, 1, 0});
  m.binning_x(0);
  m.binning_y(0);
  return m;
}

Result<octomap_msgs::msg::dds_::Octomap_> octomap(const v1::OctreeMap& map, const Frames& frames) {
  const auto bad = [](const char* what) {
    return Error{ErrorCode::kBadData, "octree_map", what, ""};
  };
  if (crc32c(map.payload()) != map.crc32c()) return bad("fails its checksum");
  auto file = decompress(map.payload(), map.decoded_bytes());
  if (!file) return file.error();
  // octomap_msgs carries what follows the header of a .bt file.
  constexpr std::string_view kEnd = "\ndata\n";
  const auto at = std::search(file->begin(), file->end(), kEnd.begin(), kEnd.end());
  if (at == file->end()) return bad("has no header of a .bt file");
  octomap_msgs::msg::dds_::Octomap_ m;
  m.header(header(map.time_ns(), frames.map));
  m.binary(true);
  m.id("OcTree");
  m.resolution(map.voxel_m());
  m.data().assign(at + std::ptrdiff_t(kEnd.size()), file->end());
  return m;
}

nav_msgs::msg::dds_::OccupancyGrid_ occupancy_grid(const client::HeightGrid& g, TimeNs time,
                                                   const Frames& frames) {
  nav_msgs::msg::dds_::OccupancyGrid_ m;
  m.header(header(time, frames.map));
  m.info().map_load_time(m.header().stamp());
  m.info().resolution(static_cast<float>(g.cell_m));
  m.info().width(g.columns);
  m.info().height(g.rows);
  m.info().origin().position().x(g.origin_x_m);
  m.info().origin().position().y(g.origin_y_m);
  m.info().origin().position().z(0);
  m.info().origin().orientation().w(1);
  m.data().reserve(g.cells.size());
  for (const client::Height& c : g.cells)
    m.data().push_back(static_cast<std::int8_t>(c.surface == client::Surface::kFloor      ? 0
                                                : c.surface == client::Surface::kObstacle ? 100
                                                                                          : -1));
  return m;
}

sm::PointCloud2_ heights(const client::HeightGrid& g, TimeNs time, const Frames& frames) {
  sm::PointCloud2_ m = empty_cloud(time, frames.map, {"x", "y", "z"});
  std::uint32_t points = 0;
  for (std::size_t i = 0; i < g.cells.size(); ++i) {
    const client::Height& c = g.cells[i];
    if (!client::is_known(c.surface)) continue;
    put(m.data(), static_cast<float>(g.x_m(i)));
    put(m.data(), static_cast<float>(g.y_m(i)));
    put(m.data(), static_cast<float>(c.height_m));
    ++points;
  }
  m.height(1);
  m.width(points);
  m.row_step(points * m.point_step());
  m.is_dense(true);
  return m;
}

geometry_msgs::msg::dds_::TransformStamped_ transform(const std::string& parent,
                                                      const std::string& child, TimeNs time,
                                                      const Eigen::Isometry3d& T) {
  geometry_msgs::msg::dds_::TransformStamped_ m;
  m.header(header(time, parent));
  m.child_frame_id(child);
  m.transform().translation().x(T.translation().x());
  m.transform().translation().y(T.translation().y());
  m.transform().translation().z(T.translation().z());
  const Eigen::Quaterniond q(T.linear());
  m.transform().rotation().x(q.x());
  m.transform().rotation().y(q.y());
  m.transform().rotation().z(q.z());
  m.transform().rotation().w(q.w());
  return m;
}

diagnostic_msgs::msg::dds_::DiagnosticArray_ diagnostics(const std::vector<v1::ServiceStatus>& all,
                                                         const client::Status& map, TimeNs time,
                                                         std::uint32_t crane) {
  namespace dm = diagnostic_msgs::msg::dds_;
  const std::string hardware = "crane_" + std::to_string(crane);
  dm::DiagnosticArray_ m;
  m.header(header(time, ""));
  dm::DiagnosticStatus_ whole;
  whole.level(map.valid && map.complete ? 0 : map.alive ? 1 : 2);
  whole.name("cranemap: map");
  whole.message(map.valid ? map.complete ? "valid" : "valid, tiles on their way" : map.reason);
  whole.hardware_id(hardware);
  whole.values() = {pair("revision", std::to_string(map.revision)),
                    pair("tiles", std::to_string(map.tiles)),
                    pair("frames integrated", std::to_string(map.frames_integrated)),
                    pair("frames rejected", std::to_string(map.frames_rejected)),
                    pair("frames missing", std::to_string(map.frames_missing))};
  m.status().push_back(whole);
  for (const v1::ServiceStatus& s : all) {
    dm::DiagnosticStatus_ d;
    d.level(static_cast<std::uint8_t>(s.status()));
    d.name(std::string("cranemap: ") + service_name(s.service()));
    d.message(s.message().c_str());
    d.hardware_id(hardware);
    d.values() = {pair("version", s.version().c_str()),
                  pair("received", std::to_string(s.received())),
                  pair("published", std::to_string(s.published()))};
    for (const v1::DropCount& drop : s.dropped())
      d.values().push_back(pair(drop.cause().c_str(), std::to_string(drop.count())));
    m.status().push_back(d);
  }
  return m;
}

}  // namespace crane::ros2
