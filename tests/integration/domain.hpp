// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <chrono>
#include <functional>
#include <thread>

#include "dds/endpoints.hpp"

namespace crane::test {

enum class Transport { kAuto, kUdp };

/// Loopback only, in a domain that other test processes hardly use.
inline dds::Settings settings(Transport transport = Transport::kAuto) {
  dds::Settings s;
  s.domain = 100 + static_cast<std::uint32_t>(getpid()) % 100;
  if (transport == Transport::kUdp) s.shared_memory = false;
  return s;
}

/// Waits for a condition, at most 10 s.
inline bool eventually(const std::function<bool()>& condition) {
  for (int i = 0; i < 1000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return condition();
}

}  // namespace crane::test
