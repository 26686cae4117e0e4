// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/clock.hpp"

namespace crane::gateway {

/// What a viewer that speaks Foxglove's protocol may subscribe to. Ids of the protocol: plus 1.
enum class Channel { kTransforms, kLog, kHeights, kVoxels, kCloud, kImage };
inline constexpr std::size_t kChannels = 6;

/// What each channel said last: of most the newest alone, of transforms and log some more, as what
/// came before is needed as well. Whoever reads slowly misses messages, and keeps nobody from
/// anything. Any thread.
class FoxgloveChannels {
 public:
  /// `payload`: a message as its schema has it.
  void put(Channel channel, TimeNs time, std::string payload);

  struct Said {
    std::uint64_t number = 0;
    TimeNs time = 0;  ///< when it was put, Unix epoch
    std::shared_ptr<const std::string> payload;
  };
  /// The oldest that is kept and was said after `number`; nothing: there is none yet.
  [[nodiscard]] std::optional<Said> after(Channel channel, std::uint64_t number) const;

  /// One more, or one fewer, that wants the channel. What nobody wants is forgotten, except
  /// transforms and log.
  void want(Channel channel, int change);
  [[nodiscard]] bool wanted(Channel channel) const;

 private:
  struct State {
    std::deque<Said> kept;
    std::uint64_t last = 0;
    int wanted = 0;
  };
  mutable std::mutex mutex_;
  std::array<State, kChannels> states_;
};

}  // namespace crane::gateway
