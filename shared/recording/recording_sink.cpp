// SPDX-License-Identifier: Apache-2.0
#include "recording/recording_sink.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <future>
#include <system_error>

#include "base/write_file.hpp"
#include "config/yaml_text.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRangeFolders[] = {"cart0", "cart1", "trolley0"};

Error cannot_write(const std::string& path, int why) {
  return {ErrorCode::kResource, path, "cannot be written: " + std::generic_category().message(why),
          "check permissions and free space"};
}

std::string exactly(double value) {
  return std::isfinite(value) ? yaml_exact(value) : "nan";
}

/// Whole, or not there. Not synced: images come faster than a disk could.
Result<void> write_image_bytes(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return cannot_write(path, errno);
  int why = 0;
  for (std::size_t done = 0; done < bytes.size() && why == 0;) {
    const ssize_t n = write(file, bytes.data() + done, bytes.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      why = n == 0 ? ENOSPC : errno;
  }
  if (close(file) != 0 && why == 0) why = errno;
  if (why == 0) return {};
  std::error_code ignored;
  fs::remove(path, ignored);
  return cannot_write(path, why);
}

}  // namespace

Result<RecordingSink> RecordingSink::create(const SinkOptions& options, const StereoRig& rig,
                                            double rate_hz, const RangefinderModel& rangefinder) {
  RecordingSink sink(options);
  sink.rig_ = rig;
  sink.rate_hz_ = rate_hz;
  sink.model_ = rangefinder;
  std::error_code failed;
  fs::create_directories(options.folder, failed);
  if (failed) return cannot_write(options.folder, failed.value());
  if (!fs::is_empty(options.folder, failed) && !failed)
    return Error{ErrorCode::kConfiguration, options.folder, "is not empty",
                 "give a new folder, or remove this one first; nothing was changed"};
  if (auto written = write_rig(rig, options.folder, rate_hz); !written) return written.error();
  for (const char* camera : {"cam0", "cam1"}) {
    auto index = sink.make_index(camera, "#timestamp [ns],filename");
    if (!index) return index.error();
    sink.cameras_.push_back(std::move(*index));
  }
  return sink;
}

std::string RecordingSink::image_path(int side, TimeNs time) const {
  return options_.folder + "/cam" + std::to_string(side) + "/data/" + std::to_string(time) + "." +
         options_.format;
}

Result<SensorIndex> RecordingSink::make_index(const std::string& sensor,
                                              const std::string& header) const {
  return SensorIndex::create(options_.folder + "/" + sensor + "/data.csv", header,
                             options_.ring > 0);
}

Result<void> RecordingSink::add_frame(TimeNs time, const Image& left, const Image& right) {
  const auto encode = [this](const Image& image) {
    return encode_image(image, options_.format, options_.jpeg_quality);
  };
  auto other = std::async(std::launch::async, [&] { return encode(right); });
  const auto left_bytes = encode(left);
  const auto right_bytes = other.get();
  if (!left_bytes) return left_bytes.error();
  if (!right_bytes) return right_bytes.error();
  return add_files(time, *left_bytes, *right_bytes);
}

Result<void> RecordingSink::add_frame(TimeNs time, const DeepImage& left, const DeepImage& right) {
  expects(is_lossless() && left.bits == right.bits, "both are of one kind, and PNG");
  if (rig_.left.bits != left.bits) {
    if (rig_.left.bits != 0)
      return Error{ErrorCode::kConfiguration, options_.folder,
                   "has images of " + std::to_string(rig_.left.bits) + " bits, now they have " +
                       std::to_string(left.bits),
                   "end this recording and begin another"};
    StereoRig rig = rig_;
    rig.left.bits = rig.right.bits = left.bits;
    if (auto written = write_rig(rig, options_.folder, rate_hz_); !written) return written;
    rig_ = rig;
  }
  auto other = std::async(std::launch::async, [&] { return encode_deep(right); });
  const auto left_bytes = encode_deep(left);
  const auto right_bytes = other.get();
  if (!left_bytes) return left_bytes.error();
  if (!right_bytes) return right_bytes.error();
  return add_files(time, *left_bytes, *right_bytes);
}

Result<void> RecordingSink::add_files(TimeNs time, const std::vector<std::uint8_t>& left,
                                      const std::vector<std::uint8_t>& right) {
  auto written = write_image_bytes(image_path(0, time), left);
  if (!written) return written;
  written = write_image_bytes(image_path(1, time), right);
  if (!written) {
    std::error_code ignored;
    fs::remove(image_path(0, time), ignored);
    return written;
  }
  for (SensorIndex& camera : cameras_)
    camera.add(time, std::to_string(time) + "." + options_.format);
  frames_.push_back({time, left.size() + right.size()});
  bytes_ += frames_.back().bytes;
  return {};
}

Result<void> RecordingSink::add_distance(Sensor sensor, TimeNs time, double distance_m,
                                         double accuracy_m) {
  const auto i = static_cast<std::size_t>(sensor);
  if (!ranges_[i]) {
    const std::string folder = kRangeFolders[i];
    auto index = make_index(folder, "#timestamp [ns],distance [m]");
    if (!index) return index.error();
    RangefinderModel model = model_;
    model.accuracy_m = accuracy_m;
    if (auto written = write_rangefinder(options_.folder + "/" + folder + "/sensor.yaml", model);
        !written)
      return written;
    ranges_[i].emplace(std::move(*index));
  }
  ranges_[i]->add(time, exactly(distance_m));
  return {};
}

Result<void> RecordingSink::add_hoist(const HoistReading& r) {
  if (!hoist_) {
    auto index = make_index("hoist0",
                            "#timestamp [ns],hook height [m],sling [m],load x [m],load y [m],load "
                            "z [m],load yaw [rad],sway x [m],sway y [m]");
    if (!index) return index.error();
    hoist_.emplace(std::move(*index));
  }
  std::string line = exactly(r.hook_height_m);
  for (const double value : {r.sling_m, r.load_size_m.x(), r.load_size_m.y(), r.load_size_m.z(),
                             r.load_yaw_rad, r.sway_m.x(), r.sway_m.y()})
    line += "," + exactly(value);
  hoist_->add(r.time, std::move(line));
  return {};
}

/// Frames that are too old, or too many, and what was measured before them.
void RecordingSink::shrink() {
  constexpr TimeNs kPositionsBefore = 2 * kNsPerSecond;
  if (options_.ring == 0 || frames_.empty()) return;
  const TimeNs oldest = frames_.back().time - options_.ring;
  while (frames_.size() > 1 && (frames_.front().time < oldest ||
                                (options_.max_bytes > 0 && bytes_ > options_.max_bytes))) {
    given_up_.push_back(frames_.front().time);
    bytes_ -= frames_.front().bytes;
    frames_.pop_front();
  }
  for (SensorIndex& camera : cameras_) camera.drop_before(frames_.front().time);
  for (auto& range : ranges_)
    if (range) range->drop_before(frames_.front().time - kPositionsBefore);
  if (hoist_) hoist_->drop_before(frames_.front().time - kPositionsBefore);
}

Result<void> RecordingSink::flush() {
  shrink();
  Result<void> good;
  const auto flush = [&good](SensorIndex& index) {
    if (auto flushed = index.flush(); !flushed && good) good = flushed;
  };
  for (auto& range : ranges_)
    if (range) flush(*range);
  if (hoist_) flush(*hoist_);
  for (SensorIndex& camera : cameras_) flush(camera);
  if (!good) return good;
  std::error_code ignored;
  for (const TimeNs time : given_up_)
    for (const int side : {0, 1}) fs::remove(image_path(side, time), ignored);
  given_up_.clear();
  return {};
}

Result<void> RecordingSink::write_text(const std::string& name, const std::string& text) const {
  return write_file(options_.folder + "/" + name,
                    reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace crane
