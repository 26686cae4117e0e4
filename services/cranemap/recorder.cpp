// SPDX-License-Identifier: Apache-2.0
#include "recorder.hpp"

#include <filesystem>

#include "base/log.hpp"
#include "imaging/convert.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr auto kFlushEvery = 1s;
/// A ring's index is written anew each time.
constexpr auto kFlushRingEvery = 5s;
/// A disk that takes nothing for so long will not.
constexpr double kGiveUpMs = 10'000;

std::uint64_t bytes_of(const RecordedPair& pair) {
  return pair.left.size() + pair.right.size();
}

/// Files are grey or BGR of 8 bits, whatever the camera's format; lossless ones of a grey camera of
/// 10 or 12 bits have them all.
Result<void> write_pair(const RecordedPair& pair, RecordingSink& sink) {
  const auto image = [&pair](const std::vector<std::uint8_t>& bytes) {
    return to_image({pair.format, pair.width, pair.height, bytes});
  };
  if (sink.is_lossless() && is_deep_grey(pair.format)) {
    const auto left = to_deep({pair.format, pair.width, pair.height, pair.left});
    if (!left) return left.error();
    const auto right = to_deep({pair.format, pair.width, pair.height, pair.right});
    if (!right) return right.error();
    return sink.add_frame(pair.time, *left, *right);
  }
  const auto left = image(pair.left);
  if (!left) return left.error();
  const auto right = image(pair.right);
  if (!right) return right.error();
  return sink.add_frame(pair.time, *left, *right);
}

}  // namespace

Recorder::Recorder(RecordingSink sink, std::string folder, const Limits& limits)
    : sink_(std::move(sink)), folder_(std::move(folder)), limits_(limits) {
  thread_ = std::thread([this] { run(); });
}

Recorder::~Recorder() {
  finish();
}

bool Recorder::put(RecordedPair pair) {
  const std::uint64_t bytes = bytes_of(pair);
  return enqueue(std::move(pair), bytes);
}
bool Recorder::put(const RecordedReading& reading) {
  return enqueue(reading, 0);
}
bool Recorder::put(const HoistReading& reading) {
  return enqueue(reading, 0);
}

/// What places the last frame is still wanted once there are enough frames.
bool Recorder::wanted(bool is_frame) const {
  return state_.ended.empty() || (state_.ended_well && !is_frame);
}

bool Recorder::enqueue(Item item, std::uint64_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (!wanted(bytes > 0)) return true;
    if (items_.size() >= limits_.queued) return false;
    if (bytes > 0 && queued_bytes_ + bytes > limits_.queued_bytes) return false;
    queued_bytes_ += bytes;
    items_.push_back(std::move(item));
  }
  more_.notify_one();
  return true;
}

Recorder::State Recorder::state() const {
  const std::lock_guard lock(mutex_);
  State state = state_;
  state.waiting = items_.size();
  return state;
}

const RecordingSink& Recorder::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  more_.notify_one();
  if (thread_.joinable()) thread_.join();
  return sink_;
}

void Recorder::end(const std::string& why, bool well) {
  const std::lock_guard lock(mutex_);
  if (!state_.ended.empty()) return;
  state_.ended = why;
  state_.ended_well = well;
}

void Recorder::run() {
  const auto every = sink_.is_ring() ? kFlushRingEvery : kFlushEvery;
  auto next_flush = std::chrono::steady_clock::now() + every;
  const auto flush = [&] {
    note(sink_.flush(), index_trouble_);
    {
      const std::lock_guard counts(mutex_);  // a ring has given up its oldest
      state_.frames = sink_.frames();
      state_.bytes = sink_.bytes();
    }
    next_flush = std::chrono::steady_clock::now() + every;
  };
  for (;;) {
    std::unique_lock lock(mutex_);
    more_.wait_until(lock, next_flush, [this] { return !items_.empty() || finishing_; });
    if (items_.empty() && finishing_) break;
    if (!items_.empty()) {
      const Item item = std::move(items_.front());
      items_.pop_front();
      const bool goes_on = wanted(std::holds_alternative<RecordedPair>(item));
      lock.unlock();
      if (goes_on) write(item);
      lock.lock();
      if (const auto* pair = std::get_if<RecordedPair>(&item)) queued_bytes_ -= bytes_of(*pair);
    }
    lock.unlock();
    if (std::chrono::steady_clock::now() < next_flush) continue;
    flush();
    look_after_disk();
  }
  flush();
}

void Recorder::note(const Result<void>& written, std::string& trouble) {
  const bool begins = trouble.empty() && !written;
  trouble = written ? "" : written.error().text();
  if (begins) log_warning(trouble);
  const std::string now = frame_trouble_.empty() ? index_trouble_ : frame_trouble_;
  if (now.empty()) since_good_ = {};
  {
    const std::lock_guard lock(mutex_);
    state_.trouble = now;
  }
  if (since_good_.ms() > kGiveUpMs) end("nothing could be written for 10 s: " + now, false);
}

void Recorder::write(const Item& item) {
  if (const auto* pair = std::get_if<RecordedPair>(&item)) {
    const auto written = write_pair(*pair, sink_);
    note(written, frame_trouble_);
    const std::lock_guard lock(mutex_);
    if (!written) ++state_.frames_refused;
    state_.frames = sink_.frames();
    state_.bytes = sink_.bytes();
  } else if (const auto* reading = std::get_if<RecordedReading>(&item)) {
    note(sink_.add_distance(reading->sensor, reading->time, reading->distance_m,
                            reading->accuracy_m),
         index_trouble_);
  } else {
    note(sink_.add_hoist(std::get<HoistReading>(item)), index_trouble_);
  }
  if (sink_.full()) end("--max-size is reached", true);
}

void Recorder::look_after_disk() {
  std::error_code failed;
  const auto space = std::filesystem::space(folder_, failed);
  if (failed) return;
  {
    const std::lock_guard lock(mutex_);
    state_.free_bytes = space.available;
  }
  if (space.available < limits_.free_bytes)
    end("the disk has less than " + std::to_string(limits_.free_bytes >> 20U) +
            " MiB left, which others need",
        false);
}

}  // namespace crane
