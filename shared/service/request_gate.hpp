// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>

namespace crane {

/// Lets one request of each client through a pause; those between are refused, and asked again. A
/// bounded number of clients is known: when it is full, whoever was silent longest is forgotten.
template <class Client>
class RequestGate {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostClients = 64;

  explicit RequestGate(std::chrono::milliseconds pause) : pause_(pause) {}

  bool pass(const Client& client, Clock::time_point now) {
    const auto known = passed_.find(client);
    if (known != passed_.end() && now - known->second < pause_) return false;
    if (known == passed_.end() && passed_.size() >= kMostClients)
      passed_.erase(
          std::min_element(passed_.begin(), passed_.end(),
                           [](const auto& a, const auto& b) { return a.second < b.second; }));
    passed_[client] = now;
    return true;
  }

 private:
  std::chrono::milliseconds pause_;
  std::map<Client, Clock::time_point> passed_;
};

}  // namespace crane
