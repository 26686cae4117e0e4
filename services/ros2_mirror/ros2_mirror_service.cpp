// SPDX-License-Identifier: Apache-2.0
#include "ros2_mirror_service.hpp"

#include <CLI/CLI.hpp>
#include <map>
#include <optional>

#include "base/log.hpp"
#include "bounds.h"
#include "mapping_pipeline/gantry.hpp"
#include "recording/calibration.hpp"
#include "ros2_messages.hpp"
#include "service/client_options.hpp"
#include "service/every.hpp"
#include "service/key_option.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

struct Options {
  std::string calibration;
  int ros_domain = -1;
  std::uint32_t cloud_step = 4;
  double image_hz = 2, heights_hz = 1;
};

/// Everything that the mirror reads and writes. One thread.
class Mirror {
 public:
  Mirror(ServiceContext& context, const Options& options, const StereoRig& rig)
      : context_(context),
        options_(options),
        rig_(rig),
        frames_(crane()),
        image_due_(options.image_hz),
        heights_due_(options.heights_hz),
        gantry_(context.config.mapper) {}

  Result<void> run() {
    std::string why;
    map_ = client::Map::join(context_.participant->fast_dds(), map_options(context_.config), why);
    if (!map_) return Error{ErrorCode::kResource, "map", "cannot be followed: " + why, ""};
    if (auto made = make_endpoints(); !made) return made;
    log_info("mirrors crane " + std::to_string(crane()) + " as /crane_" + std::to_string(crane()) +
             "/... with frame '" + frames_.map + "'");
    send_static({});
    Every diagnostics_due(1);
    while (!context_.stopping()) {
      wakeup_.wait_for(50ms);
      Result<void> done = mirror_positions();
      if (done) done = mirror_clouds();
      if (done) done = mirror_images();
      if (done) done = mirror_octree();
      if (done && heights_due_.due()) done = mirror_heights();
      take_statuses();
      if (done && diagnostics_due.due())
        done = count(diagnostics_->write(
            ros2::diagnostics(services(), map_->status(), SystemClock().now(), crane())));
      if (!done) return done;
      context_.status.tick();
    }
    return {};
  }

 private:
  [[nodiscard]] std::uint32_t crane() const { return context_.participant->settings().crane; }

  Result<void> make_endpoints() {
    dds::Settings settings = context_.participant->settings();
    settings.partition = false;
    settings.shared_memory = false;  // what every vendor understands
    if (!settings.security.empty()) {
      if (options_.ros_domain < 0 || options_.ros_domain == static_cast<int>(settings.domain))
        return Error{ErrorCode::kConfiguration, "--ros-domain",
                     "must be another one than dds.domain when dds.security is on",
                     "ROS 2 is then served without security, in a domain of its own"};
      log_warning("the ROS 2 side is not secured: who reaches its domain can read the map");
      settings.security.clear();
    }
    if (options_.ros_domain >= 0) settings.domain = static_cast<std::uint32_t>(options_.ros_domain);
    auto ros = dds::Participant::create(settings, "cranemap-ros2-mirror");
    if (!ros) return ros.error();
    const auto read = [&]<class Topic>(std::optional<dds::Reader<Topic>>& into) -> Result<void> {
      auto made = dds::Reader<Topic>::create(context_.participant, &wakeup_);
      if (!made) return made.error();
      into.emplace(std::move(*made));
      return {};
    };
    // Per crane in its namespace; tf and diagnostics are one for all, as in ROS.
    const auto write = [&]<class Topic>(std::optional<dds::Writer<Topic>>& into,
                                        bool own_namespace) -> Result<void> {
      std::string name = Topic::kName;
      if (own_namespace) name.insert(3, "crane_" + std::to_string(crane()) + "/");
      auto made = dds::Writer<Topic>::create(*ros, name);
      if (!made) return made.error();
      into.emplace(std::move(*made));
      return {};
    };
    for (const Result<void>& made :
         {read(frames_in_), read(clouds_in_), read(positions_in_), read(octree_in_),
          read(statuses_in_), write(points_, true), write(image_, true), write(camera_info_, true),
          write(octomap_, true), write(grid_, true), write(heights_, true), write(tf_, false),
          write(tf_static_, false), write(diagnostics_, false)})
      if (!made) return made;
    return {};
  }

  Result<void> count(const Result<void>& sent) {
    if (sent)
      ++context_.status.published;
    else
      context_.status.dropped.add(Cause::kNotAcceptedByDds);
    return {};
  }

  /// The mount, and the turn of the rectified camera once a cloud said it.
  void send_static(const std::optional<Eigen::Matrix3d>& R_camera_rectified) {
    tf2_msgs::msg::dds_::TFMessage_ m;
    const TimeNs now = SystemClock().now();
    m.transforms().push_back(
        ros2::transform(frames_.gantry, frames_.camera, now, rig_.T_map_camera_at_zero));
    if (R_camera_rectified) {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.linear() = *R_camera_rectified;
      m.transforms().push_back(ros2::transform(frames_.camera, frames_.camera_rectified, now, T));
    }
    (void)count(tf_static_->write(m));
  }

  /// map -> gantry wherever both axes are known.
  Result<void> mirror_positions() {
    while (const auto sample = positions_in_->take()) {
      const v1::RangefinderPosition& p = **sample;
      ++context_.status.received;
      if (p.device_status() != v1::STATUS_OK) continue;
      const Axis axis = p.axis() == v1::AXIS_CART      ? Axis::kCart
                        : p.axis() == v1::AXIS_TROLLEY ? Axis::kTrolley
                                                       : Axis::kCartSecond;
      // What cannot be true is counted by the mapper.
      (void)gantry_.add(axis, p.stream(), p.time_ns(), p.distance_m());
      if (axis != Axis::kCartSecond) newest_[axis == Axis::kCart ? 0 : 1] = p.time_ns();
    }
    const TimeNs time = std::min(newest_[0], newest_[1]);
    if (time == sent_until_) return {};
    const Gantry::Place place = gantry_.at(time);
    if (place.known != PositionTrack::Lookup::kFound) return {};
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().head<2>() = place.map_m;
    T.linear() = Eigen::AngleAxisd(place.skew_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    sent_until_ = time;
    tf2_msgs::msg::dds_::TFMessage_ m;
    m.transforms().push_back(ros2::transform(frames_.map, frames_.gantry, time, T));
    return count(tf_->write(m));
  }

  Result<void> mirror_clouds() {
    while (const auto sample = clouds_in_->take()) {
      const dds::PartialCloud& c = **sample;
      ++context_.status.received;
      Eigen::Matrix3d R;
      for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = c.rotation()[static_cast<std::size_t>(i)];
      if (!turn_ || !turn_->isApprox(R)) send_static(turn_ = R);
      if (points_->matched() == 0) continue;
      const auto message = ros2::point_cloud(c, options_.cloud_step, frames_);
      if (!sample->intact()) {
        context_.status.dropped.add(Cause::kCloudOverwritten);
        continue;
      }
      if (auto done = count(points_->write(message)); !done) return done;
    }
    return {};
  }

  Result<void> mirror_images() {
    while (const auto sample = frames_in_->take()) {
      ++context_.status.received;
      if (image_->matched() + camera_info_->matched() == 0 || !image_due_.due()) continue;
      auto message = ros2::image(**sample, frames_);
      const TimeNs time = (*sample)->exposure_time_ns();
      if (!sample->intact()) {
        context_.status.dropped.add(Cause::kFrameOverwritten);
        continue;
      }
      if (message)
        (void)count(image_->write(*message));
      else
        context_.status.dropped.add(Cause::kFrameMisfit);
      if (auto done = count(camera_info_->write(ros2::camera_info(rig_.left, time, frames_)));
          !done)
        return done;
    }
    return {};
  }

  Result<void> mirror_octree() {
    while (const auto sample = octree_in_->take()) {
      ++context_.status.received;
      auto message = ros2::octomap(**sample, frames_);
      if (!message) {
        context_.status.dropped.add(Cause::kOctreeRefused);
        continue;
      }
      if (auto done = count(octomap_->write(*message)); !done) return done;
    }
    return {};
  }

  Result<void> mirror_heights() {
    const client::Status s = map_->status();
    if (!s.complete || s.revision == heights_revision_) return {};
    heights_revision_ = s.revision;
    const client::HeightGrid grid = map_->heights();
    (void)count(grid_->write(ros2::occupancy_grid(grid, s.last_frame_time_ns, frames_)));
    return count(heights_->write(ros2::heights(grid, s.last_frame_time_ns, frames_)));
  }

  void take_statuses() {
    while (const auto sample = statuses_in_->take()) statuses_[(*sample)->service()] = **sample;
  }
  [[nodiscard]] std::vector<v1::ServiceStatus> services() const {
    std::vector<v1::ServiceStatus> all;
    for (const auto& [service, status] : statuses_) all.push_back(status);
    return all;
  }

  ServiceContext& context_;
  const Options& options_;
  StereoRig rig_;
  ros2::Frames frames_;
  Every image_due_, heights_due_;
  Wakeup wakeup_;
  std::unique_ptr<client::Map> map_;
  std::optional<dds::Reader<dds::StereoFrameTopic>> frames_in_;
  std::optional<dds::Reader<dds::PartialCloudTopic>> clouds_in_;
  std::optional<dds::Reader<dds::RangefinderPositionTopic>> positions_in_;
  std::optional<dds::Reader<dds::OctreeMapTopic>> octree_in_;
  std::optional<dds::Reader<dds::ServiceStatusTopic>> statuses_in_;
  std::optional<dds::Writer<dds::ros2::PointCloudTopic>> points_;
  std::optional<dds::Writer<dds::ros2::ImageTopic>> image_;
  std::optional<dds::Writer<dds::ros2::CameraInfoTopic>> camera_info_;
  std::optional<dds::Writer<dds::ros2::OctomapTopic>> octomap_;
  std::optional<dds::Writer<dds::ros2::OccupancyGridTopic>> grid_;
  std::optional<dds::Writer<dds::ros2::HeightsTopic>> heights_;
  std::optional<dds::Writer<dds::ros2::TfTopic>> tf_;
  std::optional<dds::Writer<dds::ros2::TfStaticTopic>> tf_static_;
  std::optional<dds::Writer<dds::ros2::DiagnosticsTopic>> diagnostics_;
  Gantry gantry_;
  std::uint64_t heights_revision_ = 0;
  TimeNs newest_[2] = {0, 0}, sent_until_ = 0;
  std::optional<Eigen::Matrix3d> turn_;
  std::map<std::uint32_t, v1::ServiceStatus> statuses_;
};

}  // namespace

int run_ros2_mirror(int argc, char** argv) {
  Options options;
  const ServiceInfo info{
      "cranemap-ros2-mirror",
      "The crane's topics once more as ROS 2's, so that RViz2 shows the map: /crane_N/points,\n"
      "image_raw, camera_info, octomap_binary, occupancy_grid, heights, and /tf, /tf_static,\n"
      "/diagnostics. Example: cranemap-ros2-mirror --config site.yaml --calibration RECORDING",
      v1::SERVICE_ROS2_MIRROR};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        app.add_option("--calibration", options.calibration,
                       "Folder with cam0/sensor.yaml, cam1/sensor.yaml and rig.yaml")
            ->required();
        app.add_option("--ros-domain", options.ros_domain, "ROS_DOMAIN_ID; without it dds.domain")
            ->check(within<CLI::Range>("dds.domain", 0));
        app.add_option("--cloud-step", options.cloud_step,
                       "points: every n-th pixel of every n-th row")
            ->check(CLI::Range(1, 32))
            ->capture_default_str();
        app.add_option("--image-hz", options.image_hz, "Images a second at most; 0 = none")
            ->check(CLI::Range(0.0, 100.0))
            ->capture_default_str();
        app.add_option("--heights-hz", options.heights_hz, "Height maps a second at most; 0 = none")
            ->check(CLI::Range(0.0, 100.0))
            ->capture_default_str();
      },
      [&](ServiceContext& context) -> Result<void> {
        auto rig = read_rig(options.calibration);
        if (!rig) return rig.error();
        return Mirror(context, options, *rig).run();
      });
}

}  // namespace crane
