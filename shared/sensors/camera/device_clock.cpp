// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/device_clock.hpp"

#include <algorithm>

namespace crane {

void DeviceClock::reset() {
  seen_.clear();
  offset_ = late_ = 0;
}

TimeNs DeviceClock::to_host(TimeNs device, TimeNs host) {
  const TimeNs difference = host - device;
  if (!seen_.empty() && (difference < offset_ - kStep || difference > offset_ + kLost)) {
    ++steps_;
    seen_.clear();
  }
  seen_.push_back(difference);
  if (seen_.size() > kWindow) seen_.pop_front();
  offset_ = *std::min_element(seen_.begin(), seen_.end());
  late_ = difference - offset_;
  return device + offset_;
}

}  // namespace crane
