// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace crane::gateway {

/// The newest state, as the stream says it. Any thread.
class StateBoard {
 public:
  void put(std::string json) {
    auto shared = std::make_shared<const std::string>(std::move(json));
    const std::lock_guard lock(mutex_);
    json_ = std::move(shared);
    ++number_;
  }
  struct Said {
    std::uint64_t number = 0;  ///< 0: nothing yet
    std::shared_ptr<const std::string> json;
  };
  [[nodiscard]] Said now() const {
    const std::lock_guard lock(mutex_);
    return {number_, json_};
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t number_ = 0;
  std::shared_ptr<const std::string> json_;
};

}  // namespace crane::gateway
