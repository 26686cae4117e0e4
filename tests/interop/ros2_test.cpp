// SPDX-License-Identifier: Apache-2.0
// The mirror's bytes against the .msg files of the ROS packages, and its topics as a reader of
// another vendor gets them by ROS 2's names.

#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <list>
#include <map>
#include <sstream>
#include <thread>

#include "bounds.h"
#include "cyclone.hpp"
#include "map_codec/compression.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/octree_stream.hpp"
#include "ros2PubSubTypes.h"
#include "ros2_messages.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;
namespace rtps = eprosima::fastrtps::rtps;

struct Field {
  std::string type, name;
};

/// Fields of a message as its .msg file has them, with what ROS 2 changed since: Header has no seq,
/// time is builtin_interfaces/Time.
std::vector<Field> fields_of(const std::string& type) {
  if (type == "std_msgs/Header")
    return {{"builtin_interfaces/Time", "stamp"}, {"string", "frame_id"}};
  if (type == "builtin_interfaces/Time") return {{"int32", "sec"}, {"uint32", "nanosec"}};
  if (type == "octomap_msgs/Octomap")  // not among Debian's packages
    return {{"std_msgs/Header", "header"},
            {"bool", "binary"},
            {"string", "id"},
            {"float64", "resolution"},
            {"int8[]", "data"}};
  const std::size_t slash = type.find('/');
  const std::string package = type.substr(0, slash);
  std::ifstream file("/usr/share/" + package + "/msg/" + type.substr(slash + 1) + ".msg");
  EXPECT_TRUE(file) << type << ": is ros-" << package << " installed?";
  std::vector<Field> out;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    Field f;
    if (!(words >> f.type >> f.name) ||
        line.substr(0, line.find('#')).find('=') != std::string::npos)
      continue;
    if (f.type == "Header") f.type = "std_msgs/Header";
    if (f.type == "time") f.type = "builtin_interfaces/Time";
    std::string base = f.type.substr(0, f.type.find('['));
    if (std::isupper(static_cast<unsigned char>(base[0])) != 0) f.type = package + "/" + f.type;
    out.push_back(f);
  }
  return out;
}

/// Reads CDR (little-endian, XCDR1) as a message definition says, into values by path.
class Walk {
 public:
  Walk(std::vector<std::uint8_t> payload, const std::string& type) : bytes_(std::move(payload)) {
    EXPECT_GE(bytes_.size(), 4U);
    EXPECT_EQ(bytes_[1], 1) << "CDR_LE";
    at_ = 4;
    read(type, "");
    // At most padding to four bytes behind it.
    EXPECT_LT(bytes_.size() - at_, 4U) << "bytes that no field accounts for";
  }
  std::map<std::string, std::string> values;

  double number(const std::string& path) {
    EXPECT_TRUE(values.contains(path)) << path;
    return std::strtod(values[path].c_str(), nullptr);
  }
  const std::uint8_t* data(const std::string& path) { return bytes_.data() + starts_.at(path); }

 private:
  void align(std::size_t size) { at_ += (size - (at_ - 4) % size) % size; }
  template <class T>
  T take() {
    align(sizeof(T));
    T value{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    if (at_ + sizeof(T) <= bytes_.size()) std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <class T>
  void put(const std::string& path) {
    std::ostringstream s;
    s.precision(17);
    s << +take<T>();
    values[path] = s.str();
  }

  void read(const std::string& type, const std::string& path) {
    if (const std::size_t bracket = type.find('['); bracket != std::string::npos) {
      const std::string element = type.substr(0, bracket);
      const std::string fixed = type.substr(bracket + 1, type.size() - bracket - 2);
      const std::size_t count = fixed.empty() ? take<std::uint32_t>() : std::stoul(fixed);
      values[path + ".size"] = std::to_string(count);
      ASSERT_LE(count, bytes_.size());
      if (element == "uint8" || element == "int8") {
        starts_[path] = at_;
        at_ += count;
        ASSERT_LE(at_, bytes_.size());
        return;
      }
      for (std::size_t i = 0; i < count; ++i) read(element, path + "[" + std::to_string(i) + "]");
      return;
    }
    if (type == "bool" || type == "uint8" || type == "byte") return put<std::uint8_t>(path);
    if (type == "int8") return put<std::int8_t>(path);
    if (type == "int32") return put<std::int32_t>(path);
    if (type == "uint32") return put<std::uint32_t>(path);
    if (type == "float32") return put<float>(path);
    if (type == "float64") return put<double>(path);
    if (type == "string") {
      const auto size = take<std::uint32_t>();
      ASSERT_GE(size, 1U) << path;
      ASSERT_LE(at_ + size, bytes_.size()) << path;
      values[path] = std::string(reinterpret_cast<const char*>(bytes_.data() + at_), size - 1);
      EXPECT_EQ(bytes_[at_ + size - 1], 0) << path;
      at_ += size;
      return;
    }
    for (const Field& f : fields_of(type))
      read(f.type, path.empty() ? f.name : path + "." + f.name);
  }

  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::map<std::string, std::size_t> starts_;
};

template <class PubSubType, class Type>
Walk walk(Type message, const std::string& type) {
  PubSubType support;
  const std::string name =
      type.substr(0, type.find('/')) + "::msg::dds_::" + type.substr(type.find('/') + 1) + "_";
  EXPECT_EQ(std::string(support.getName()), name);
  EXPECT_FALSE(support.m_isGetKeyDefined);
  rtps::SerializedPayload_t payload(support.getSerializedSizeProvider(&message)() + 8);
  EXPECT_TRUE(support.serialize(&message, &payload));
  return {{payload.data, payload.data + payload.length}, type};
}

constexpr TimeNs kTime = 1'700'000'001'250'000'000;
const ros2::Frames kFrames(1);

TEST(Ros2Bytes, PointCloud2) {
  auto cloud = std::make_unique<dds::PartialCloud>();
  cloud->exposure_time_ns(kTime);
  cloud->width(64);
  cloud->height(48);
  cloud->f_px(100);
  cloud->cx_px(31.5);
  cloud->cy_px(23.5);
  cloud->has_colour(1);
  cloud->depth().resize(64 * 48);
  cloud->colour().resize(3 * 64 * 48);
  cloud->depth()[8 * 64 + 4] = 2.5F;
  cloud->colour()[3 * (8 * 64 + 4) + 2] = 200;
  auto w = walk<sensor_msgs::msg::dds_::PointCloud2_PubSubType>(
      ros2::point_cloud(*cloud, 4, kFrames), "sensor_msgs/PointCloud2");
  EXPECT_EQ(w.values["header.stamp.sec"], "1700000001");
  EXPECT_EQ(w.values["header.stamp.nanosec"], "250000000");
  EXPECT_EQ(w.values["header.frame_id"], "crane_1/camera_rectified");
  EXPECT_EQ(w.values["height"], "12");
  EXPECT_EQ(w.values["width"], "16");
  EXPECT_EQ(w.values["fields.size"], "4");
  EXPECT_EQ(w.values["fields[3].name"], "rgb");
  EXPECT_EQ(w.values["fields[3].offset"], "12");
  EXPECT_EQ(w.values["fields[3].datatype"], "7");
  EXPECT_EQ(w.values["point_step"], "16");
  EXPECT_EQ(w.values["row_step"], "256");
  EXPECT_EQ(w.values["data.size"], "3072");
  EXPECT_EQ(w.values["is_dense"], "0");
  const auto at = [&](int point, int field) {
    float value = 0;
    std::memcpy(&value, w.data("data") + 16 * point + 4 * field, 4);
    return value;
  };
  EXPECT_TRUE(std::isnan(at(0, 2))) << "no match is NaN (REP-117)";
  EXPECT_FLOAT_EQ(at(2 * 16 + 1, 0), (4 - 31.5F) / 100 * 2.5F);
  EXPECT_FLOAT_EQ(at(2 * 16 + 1, 1), (8 - 23.5F) / 100 * 2.5F);
  EXPECT_FLOAT_EQ(at(2 * 16 + 1, 2), 2.5F);
  EXPECT_EQ(w.data("data")[16 * 33 + 14], 200) << "red";
}

TEST(Ros2Bytes, ImageAndCameraInfo) {
  auto frame = std::make_unique<dds::StereoFrame>();
  frame->exposure_time_ns(kTime);
  frame->encoding(v1::ENCODING_BGR8);
  frame->width(40);
  frame->height(30);
  frame->left().resize(3600);
  frame->left()[7] = 99;
  auto w = walk<sensor_msgs::msg::dds_::Image_PubSubType>(*ros2::image(*frame, kFrames),
                                                          "sensor_msgs/Image");
  EXPECT_EQ(w.values["encoding"], "bgr8");
  EXPECT_EQ(w.values["step"], "120");
  EXPECT_EQ(w.values["data.size"], "3600");
  EXPECT_EQ(w.data("data")[7], 99);
  CameraModel camera{1280, 720, 700.5, 701.5, 639.25, 359.75, -0.1, 0.02, 0.001, -0.002};
  auto i = walk<sensor_msgs::msg::dds_::CameraInfo_PubSubType>(
      ros2::camera_info(camera, kTime, kFrames), "sensor_msgs/CameraInfo");
  EXPECT_EQ(i.number("K[0]"), 700.5);
  EXPECT_EQ(i.number("K[5]"), 359.75);
  EXPECT_EQ(i.number("D[3]"), -0.002);
  EXPECT_EQ(i.number("P[6]"), 359.75);
  EXPECT_EQ(i.number("R[8]"), 1);
  EXPECT_EQ(i.values["distortion_model"], "plumb_bob");
  EXPECT_EQ(i.values["roi.do_rectify"], "0");
}

TEST(Ros2Bytes, OctomapIsWhatFollowsTheHeaderOfABtFile) {
  OccupancyMap map(0.05, 1U << 28U);
  Block& block = *map.block(map.tile({0, 0}), 0);
  for (int i = 0; i < 1000; ++i)
    block.log_odds[std::size_t(i * 17 % kBlockVoxels)] = i % 2 == 0 ? kHit : kMiss;
  const Bytes bt = write_bt(map);
  v1::OctreeMap sample;
  sample.time_ns(kTime);
  sample.voxel_m(0.05);
  sample.payload(compress(bt, 1));
  sample.crc32c(crc32c(sample.payload()));
  sample.decoded_bytes(static_cast<std::uint32_t>(bt.size()));
  auto message = ros2::octomap(sample, kFrames);
  ASSERT_TRUE(message) << message.error().text();
  auto w = walk<octomap_msgs::msg::dds_::Octomap_PubSubType>(*message, "octomap_msgs/Octomap");
  EXPECT_EQ(w.values["header.frame_id"], "map");
  EXPECT_EQ(w.values["binary"], "1");
  EXPECT_EQ(w.values["id"], "OcTree");
  EXPECT_EQ(w.number("resolution"), 0.05);
  const std::size_t size = std::stoul(w.values["data.size"]);
  ASSERT_LT(size, bt.size());
  EXPECT_EQ(std::memcmp(w.data("data"), bt.data() + bt.size() - size, size), 0);
  EXPECT_EQ(std::string(bt.begin(), bt.end() - std::ptrdiff_t(size)).substr(bt.size() - size - 6),
            "\ndata\n");
  sample.crc32c(1);
  EXPECT_FALSE(ros2::octomap(sample, kFrames));
}

TEST(Ros2Bytes, OccupancyGridAndHeights) {
  client::HeightGrid grid;
  grid.cell_m = 0.1;
  grid.origin_x_m = -1.6;
  grid.origin_y_m = 3.2;
  grid.columns = 3;
  grid.rows = 2;
  grid.cells.resize(6);
  grid.cells[1].surface = client::Surface::kFloor;
  grid.cells[2].surface = client::Surface::kObstacle;
  grid.cells[2].height_m = 1.25;
  grid.cells[4].surface = client::Surface::kStale;
  auto w = walk<nav_msgs::msg::dds_::OccupancyGrid_PubSubType>(
      ros2::occupancy_grid(grid, kTime, kFrames), "nav_msgs/OccupancyGrid");
  EXPECT_EQ(w.values["info.width"], "3");
  EXPECT_EQ(w.values["info.height"], "2");
  EXPECT_FLOAT_EQ(float(w.number("info.resolution")), 0.1F);
  EXPECT_EQ(w.number("info.origin.position.x"), -1.6);
  EXPECT_EQ(w.number("info.origin.orientation.w"), 1);
  const auto* cells = reinterpret_cast<const std::int8_t*>(w.data("data"));
  EXPECT_EQ(cells[0], -1);
  EXPECT_EQ(cells[1], 0);
  EXPECT_EQ(cells[2], 100);
  EXPECT_EQ(cells[4], -1) << "stale is unknown";
  auto h = walk<sensor_msgs::msg::dds_::PointCloud2_PubSubType>(ros2::heights(grid, kTime, kFrames),
                                                                "sensor_msgs/PointCloud2");
  EXPECT_EQ(h.values["width"], "2");
  float z = 0;
  std::memcpy(&z, h.data("data") + 12 + 8, 4);
  EXPECT_FLOAT_EQ(z, 1.25F);
}

TEST(Ros2Bytes, TransformsAndDiagnostics) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(1, 2, 3);
  T.linear() = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  tf2_msgs::msg::dds_::TFMessage_ tf;
  tf.transforms().push_back(ros2::transform("map", kFrames.gantry, kTime, T));
  auto w = walk<tf2_msgs::msg::dds_::TFMessage_PubSubType>(tf, "tf2_msgs/TFMessage");
  EXPECT_EQ(w.values["transforms[0].child_frame_id"], "crane_1/gantry");
  EXPECT_EQ(w.number("transforms[0].transform.translation.z"), 3);
  EXPECT_NEAR(w.number("transforms[0].transform.rotation.z"), std::sin(0.25), 1e-12);
  v1::ServiceStatus service;
  service.service(v1::SERVICE_STEREO);
  service.status(v1::STATUS_DEGRADED);
  service.message("dark images");
  v1::DropCount drop;
  drop.cause("black image");
  drop.count(7);
  service.dropped().push_back(drop);
  auto d = walk<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType>(
      ros2::diagnostics({service}, {}, kTime, 1), "diagnostic_msgs/DiagnosticArray");
  EXPECT_EQ(d.values["status[0].name"], "cranemap: map");
  EXPECT_EQ(d.values["status[0].level"], "2") << "no mapper heard";
  EXPECT_EQ(d.values["status[1].name"], "cranemap: stereo");
  EXPECT_EQ(d.values["status[1].level"], "1");
  EXPECT_EQ(d.values["status[1].message"], "dark images");
  EXPECT_EQ(d.values["status[1].values[3].key"], "black image");
  EXPECT_EQ(d.values["status[1].values[3].value"], "7");
}

TEST(Ros2Mirror, EveryTopicReachesAReaderOfAnotherVendorByRos2sNames) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain);
  services.emplace_back(
      std::vector<std::string>{"cranemap-ros2-mirror", "--config", folder / "site.yaml",
                               "--calibration", rig_recording()},
      folder / "mirror.txt");
  Process reader = cyclone("ros2_peer", {domain}, folder / "peer.txt");
  EXPECT_EQ(reader.wait(40), 0) << reader.output() << services.back().output();
  for (Process& service : services) service.signal(SIGTERM);
  for (Process& service : services) EXPECT_EQ(service.wait(10), 0) << service.output();
}

}  // namespace
}  // namespace crane::test
