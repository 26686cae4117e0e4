// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "geometry/hoist_reading.hpp"
#include "recording/calibration.hpp"
#include "recording/image_file.hpp"
#include "recording/sensor_index.hpp"

namespace crane {

struct SinkOptions {
  std::string folder;           ///< new or empty
  std::string format = "png";   ///< png: lossless; jpg
  int jpeg_quality = 95;        ///< 1 .. 100
  TimeNs ring = 0;              ///< keep only the last so long; 0 = all
  std::uint64_t max_bytes = 0;  ///< of images; 0 = no limit. A ring gives up its oldest for it
};

/// Writes a recording of what goes on now, in the layout that Recording::open() reads. It is whole
/// at each flush(): data.csv names no image that is not there, and has no half lines. A frame that
/// finds no room leaves nothing behind. One thread.
class RecordingSink {
 public:
  enum class Sensor { kCart, kCartSecond, kTrolley };

  /// Makes folders and calibration. Error: Resource; Configuration for a folder that is not empty.
  static Result<RecordingSink> create(const SinkOptions& options, const StereoRig& rig,
                                      double rate_hz, const RangefinderModel& rangefinder);

  /// Error: Resource, and the frame is not in the recording.
  Result<void> add_frame(TimeNs time, const Image& left, const Image& right);
  /// Grey of more than 8 bits, as PNG whatever the format of the others. The first says in
  /// sensor.yaml how many bits count; one with other bits is an error: Configuration.
  Result<void> add_frame(TimeNs time, const DeepImage& left, const DeepImage& right);
  /// NaN: the device gave none. The first accuracy of a sensor goes into its sensor.yaml.
  /// Error: Resource, when a sensor's first reading finds no room.
  Result<void> add_distance(Sensor sensor, TimeNs time, double distance_m, double accuracy_m);
  Result<void> add_hoist(const HoistReading& reading);
  /// What was added is on its way to the disk; what a ring gives up goes. Error: Resource.
  Result<void> flush();
  /// A text file beside the others: site.yaml, notes. Error: Resource.
  Result<void> write_text(const std::string& name, const std::string& text) const;

  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  /// Of the images.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Whether images are kept as they are.
  [[nodiscard]] bool is_lossless() const { return options_.format == "png"; }
  [[nodiscard]] bool is_ring() const { return options_.ring > 0; }
  /// The limit is reached, and there is no ring to give up its oldest.
  [[nodiscard]] bool full() const {
    return options_.ring == 0 && options_.max_bytes > 0 && bytes_ >= options_.max_bytes;
  }

 private:
  struct Frame {
    TimeNs time;
    std::uint64_t bytes;
  };
  explicit RecordingSink(SinkOptions options) : options_(std::move(options)) {}
  [[nodiscard]] std::string image_path(int side, TimeNs time) const;
  Result<void> add_files(TimeNs time, const std::vector<std::uint8_t>& left,
                         const std::vector<std::uint8_t>& right);
  Result<SensorIndex> make_index(const std::string& sensor, const std::string& header) const;
  void shrink();

  SinkOptions options_;
  StereoRig rig_;
  double rate_hz_ = 0;
  RangefinderModel model_;
  std::vector<SensorIndex> cameras_;                  ///< left, right
  std::array<std::optional<SensorIndex>, 3> ranges_;  ///< as Sensor counts
  std::optional<SensorIndex> hoist_;
  std::deque<Frame> frames_;
  std::vector<TimeNs> given_up_;  ///< images that no index will name
  std::uint64_t bytes_ = 0;
};

}  // namespace crane
