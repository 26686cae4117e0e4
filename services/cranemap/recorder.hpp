// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <variant>

#include "base/clock.hpp"
#include "base/drop_counts.hpp"
#include "geometry/hoist_reading.hpp"
#include "imaging/pixel_format.hpp"
#include "recording/recording_sink.hpp"

namespace crane {

/// What is to be recorded, as copies of what came.
struct RecordedPair {
  TimeNs time = 0;
  PixelFormat format = PixelFormat::kMono8;
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> left, right;  ///< as the camera gave them
};
struct RecordedReading {
  RecordingSink::Sensor sensor = RecordingSink::Sensor::kCart;
  TimeNs time = 0;
  double distance_m = 0;  ///< NaN: the device gave none
  double accuracy_m = 0;
};

/// Writes in a thread of its own: neither a slow disk nor a full one holds up who puts, who is
/// told to drop instead. Frames and readings get to the disk in the order in which they were put.
class Recorder {
 public:
  struct Limits {
    std::uint64_t queued_bytes = std::uint64_t{256} << 20U;  ///< of frames that wait
    std::size_t queued = 100'000;                            ///< frames and readings that wait
    std::uint64_t free_bytes = std::uint64_t{200} << 20U;    ///< left on the disk for others
  };
  /// How it is.
  struct State {
    std::size_t frames = 0, waiting = 0;
    std::uint64_t bytes = 0, free_bytes = 0;
    std::uint64_t frames_refused = 0;  ///< not written: no room
    std::string trouble;               ///< what is wrong now; empty: nothing
    std::string ended;                 ///< why nothing more is written; empty: it goes on
    bool ended_well = true;            ///< at a limit that was asked for
  };

  Recorder(RecordingSink sink, std::string folder, const Limits& limits);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// False: there is no room in the queue, and it is dropped. What comes after the end is ignored.
  bool put(RecordedPair pair);
  bool put(const RecordedReading& reading);
  bool put(const HoistReading& reading);
  [[nodiscard]] State state() const;

  /// Writes what waits and closes. The sink stays for notes.
  const RecordingSink& finish();

 private:
  using Item = std::variant<RecordedPair, RecordedReading, HoistReading>;
  bool enqueue(Item item, std::uint64_t bytes);
  [[nodiscard]] bool wanted(bool is_frame) const;
  void run();
  void write(const Item& item);
  void look_after_disk();
  void end(const std::string& why, bool well);
  /// What the disk says of frames, or of the index.
  void note(const Result<void>& written, std::string& trouble);

  RecordingSink sink_;
  std::string folder_;
  Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable more_;
  std::deque<Item> items_;
  std::uint64_t queued_bytes_ = 0;
  State state_;
  bool finishing_ = false;
  std::string frame_trouble_, index_trouble_;  ///< of the thread's
  Stopwatch since_good_;
  std::thread thread_;
};

}  // namespace crane
