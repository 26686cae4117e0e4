// SPDX-License-Identifier: Apache-2.0
#include "recording/recording_writer.hpp"

#include <cstdio>
#include <filesystem>

namespace crane {
namespace {

Error disk_error(const std::string& path) {
  return {ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

Result<void> add_distance(std::ofstream& file, const std::string& path, TimeNs time, double m) {
  char line[64];
  std::snprintf(line, sizeof line, "%lld,%.4f\n", static_cast<long long>(time), m);
  file << line;
  if (!file) return disk_error(path);
  return {};
}

}  // namespace

Result<RecordingWriter> RecordingWriter::create(const std::string& folder, const StereoRig& rig,
                                                double rate_hz,
                                                const RangefinderModel& rangefinder) {
  RecordingWriter w;
  w.folder_ = folder;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return disk_error(folder);
  // What is left of another recording, say its hoist0, would be read as part of this one.
  if (!std::filesystem::is_empty(folder, failed) && !failed)
    return Error{ErrorCode::kConfiguration, folder, "is not empty",
                 "give a new folder, or remove this one first; nothing was changed"};
  if (auto r = write_rig(rig, folder, rate_hz); !r) return r.error();
  for (int i = 0; i < 2; ++i) {
    w.cam_[i].open(folder + "/cam" + std::to_string(i) + "/data.csv");
    w.cam_[i] << "#timestamp [ns],filename\n";
  }
  for (const char* axis : {"cart0", "trolley0"}) {
    std::filesystem::create_directories(folder + "/" + axis, failed);
    auto sensor = write_rangefinder(folder + "/" + axis + "/sensor.yaml", rangefinder);
    if (!sensor) return sensor.error();
    std::ofstream& data = axis[0] == 'c' ? w.cart_ : w.trolley_;
    data.open(folder + "/" + axis + "/data.csv");
    data << "#timestamp [ns],distance [m]\n";
    if (!data) return disk_error(folder + "/" + axis);
  }
  return w;
}

Result<void> RecordingWriter::add_frame(TimeNs time, const Image& left, const Image& right,
                                        const std::string& extension) {
  const std::string name = std::to_string(time) + "." + extension;
  for (int i = 0; i < 2; ++i) {
    const std::string path = folder_ + "/cam" + std::to_string(i) + "/data/" + name;
    if (auto r = write_image(path, i == 0 ? left : right); !r) return r;
    cam_[i] << time << "," << name << "\n";
    if (!cam_[i]) return disk_error(path);
  }
  return {};
}

Result<void> RecordingWriter::add_cart(TimeNs time, double distance_m) {
  return add_distance(cart_, folder_ + "/cart0/data.csv", time, distance_m);
}

Result<void> RecordingWriter::add_cart_second(TimeNs time, double distance_m) {
  const std::string path = folder_ + "/cart1/data.csv";
  if (!cart_second_.is_open()) {
    std::error_code failed;
    std::filesystem::create_directories(folder_ + "/cart1", failed);
    std::filesystem::copy_file(folder_ + "/cart0/sensor.yaml", folder_ + "/cart1/sensor.yaml",
                               failed);
    cart_second_.open(path);
    cart_second_ << "#timestamp [ns],distance [m]\n";
  }
  return add_distance(cart_second_, path, time, distance_m);
}

Result<void> RecordingWriter::add_trolley(TimeNs time, double distance_m) {
  return add_distance(trolley_, folder_ + "/trolley0/data.csv", time, distance_m);
}

Result<void> RecordingWriter::add_hoist(const HoistReading& r) {
  const std::string path = folder_ + "/hoist0/data.csv";
  if (!hoist_.is_open()) {
    std::error_code failed;
    std::filesystem::create_directories(folder_ + "/hoist0", failed);
    hoist_.open(path);
    hoist_ << "#timestamp [ns],hook height [m],sling [m],load x [m],load y [m],load z [m],"
              "load yaw [rad],sway x [m],sway y [m]\n";
  }
  char line[200];
  std::snprintf(line, sizeof line, "%lld,%.4f,%.4f,%.4f,%.4f,%.4f,%.5f,%.4f,%.4f\n",
                static_cast<long long>(r.time), r.hook_height_m, r.sling_m, r.load_size_m.x(),
                r.load_size_m.y(), r.load_size_m.z(), r.load_yaw_rad, r.sway_m.x(), r.sway_m.y());
  hoist_ << line;
  if (!hoist_) return disk_error(path);
  return {};
}

Result<void> RecordingWriter::close() {
  for (std::ofstream* file : {&cam_[0], &cam_[1], &cart_, &cart_second_, &trolley_, &hoist_}) {
    if (!file->is_open()) continue;
    file->close();
    if (!*file) return disk_error(folder_);
  }
  return {};
}

}  // namespace crane
