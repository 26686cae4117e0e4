// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/cloud_queue.hpp"

#include <algorithm>

namespace crane {

void CloudQueue::add(CloudSample cloud, TimeNs now, DropCounts& counts) {
  if (cloud.stream != account_.stream) {
    account_ = FrameAccount{};
    account_.stream = cloud.stream;
    newest_ = -1;
    waiting_.clear();
  }
  const auto number = static_cast<std::int64_t>(cloud.sequence_number);
  const std::int64_t newest = std::max(account_.last_frame, newest_);
  if (number <= newest) return;  // sent again: known already
  if (cloud.after > newest) {
    counts.add(Cause::kCloudTooEarly);
    return;
  }
  newest_ = number;
  cloud.arrival_time = now;
  if (waiting_.size() == kMost) {
    counts.add(Cause::kCloudQueueFull);
    done(false, counts);
  }
  waiting_.push_back(std::move(cloud));
}

void CloudQueue::done(bool integrated, DropCounts& counts) {
  const CloudSample& cloud = waiting_.front();
  const auto number = static_cast<std::int64_t>(cloud.sequence_number);
  if (const std::int64_t gap = number - account_.last_frame - 1; gap > 0) {
    account_.missing += static_cast<std::uint64_t>(gap);
    counts.add(Cause::kCloudMissing, static_cast<std::uint64_t>(gap));
  }
  account_.last_frame = number;
  account_.last_frame_time = cloud.exposure_time;
  account_.last_frame_sent = cloud.sent_time;
  ++(integrated ? account_.integrated : account_.rejected);
  waiting_.pop_front();
}

}  // namespace crane
