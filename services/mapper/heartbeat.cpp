// SPDX-License-Identifier: Apache-2.0
#include "mapper/heartbeat.hpp"

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "base/loop_watch.hpp"
#include "bounds.h"

namespace crane {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;
constexpr auto kPeriod = 200ms;
constexpr auto kTurnsWithin = 5s;  ///< DDS may be busy with a whole map for a late joiner

}  // namespace

struct Heartbeat::Impl {
  Impl(dds::Writer<dds::MapStatusTopic> w, const MapPublisher::Identity& i)
      : writer(std::move(w)), identity(i) {}

  mutable std::mutex mutex;
  std::condition_variable changed;
  dds::Writer<dds::MapStatusTopic> writer;
  MapPublisher::Identity identity;
  std::optional<v1::MapStatus> last;
  std::uint64_t sequence = 0, not_accepted = 0;
  Steady::time_point sent_at{}, alive_at{};
  std::chrono::milliseconds hangs = kHangs;
  TimeNs last_cloud = 0, stale_after = 0;
  bool stopping = false;
  std::thread thread;

  /// The caller holds the mutex.
  void send() {
    v1::MapStatus s = *last;
    s.sequence_number(sequence++);
    s.time_ns(SystemClock().now());
    // What was true when it was said may not be any more.
    if (s.validity() == v1::STATUS_OK && stale_after > 0 && last_cloud > 0 &&
        MonotonicClock().now() - last_cloud > stale_after) {
      s.validity(v1::STATUS_DEGRADED);
      s.reason_code(v1::MAP_NO_CLOUDS);
      s.reason("no cloud was taken in for too long");
    }
    if (auto sent = writer.write(s); !sent) ++not_accepted;
    sent_at = Steady::now();
  }

  void run() {
    name_thread("heartbeat");
    const LoopWatch::Mark turning = LoopWatch::of_process().watch("heartbeat", kTurnsWithin);
    std::unique_lock lock(mutex);
    while (!stopping) {
      turning.turned();
      const auto due = sent_at + kPeriod;
      if (changed.wait_until(lock, due, [this] { return stopping; })) return;
      if (Steady::now() < sent_at + kPeriod) continue;  // something was said meanwhile
      sent_at = Steady::now();                          // also if it is left out now
      if (!last || Steady::now() - alive_at > hangs) continue;
      try {
        send();
      } catch (const std::exception&) {
        ++not_accepted;  // the next one is due soon
      }
    }
  }
};

Heartbeat::Heartbeat(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Heartbeat::~Heartbeat() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
  }
  impl_->changed.notify_all();
  if (impl_->thread.joinable()) impl_->thread.join();
}

Result<std::unique_ptr<Heartbeat>> Heartbeat::create(
    const std::shared_ptr<dds::Participant>& participant, const MapPublisher::Identity& identity) {
  auto writer = dds::Writer<dds::MapStatusTopic>::create(participant, dds::MapStatusTopic::kName,
                                                         identity.term);
  if (!writer) return writer.error();
  return std::unique_ptr<Heartbeat>(
      new Heartbeat(std::make_unique<Impl>(std::move(*writer), identity)));
}

void Heartbeat::keep_on(std::chrono::milliseconds stale_after, std::chrono::milliseconds hangs) {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->thread.joinable()) return;
  impl_->stale_after = std::chrono::nanoseconds(stale_after).count();
  impl_->hangs = hangs;
  impl_->alive_at = impl_->sent_at = Steady::now();
  impl_->thread = std::thread([raw = impl_.get()] { raw->run(); });
}

void Heartbeat::alive(TimeNs last_cloud) {
  const std::lock_guard lock(impl_->mutex);
  impl_->alive_at = Steady::now();
  impl_->last_cloud = last_cloud;
}

void Heartbeat::say(v1::MapStatus status) {
  const std::lock_guard lock(impl_->mutex);
  impl_->last = std::move(status);
  impl_->send();
}

void Heartbeat::take_over(v1::MapStatus last) {
  last.mapper(impl_->identity.mapper);
  last.mapper_start_ns(impl_->identity.mapper_start);
  last.term(static_cast<std::uint32_t>(impl_->identity.term));
  say(std::move(last));
}

std::uint64_t Heartbeat::not_accepted() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->not_accepted;
}

void Heartbeat::flush(std::chrono::milliseconds limit) {
  const std::lock_guard lock(impl_->mutex);
  (void)impl_->writer.wait_for_readers(limit);
}

}  // namespace crane
