// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include "rtps_guard/cursor.hpp"
#include "rtps_guard/refusal.hpp"

namespace crane::guard {

/// Of one DATA_FRAG (DDSI-RTPS 8.3.7.3), in its order.
struct Fragment {
  std::uint64_t sample = 0;
  std::uint32_t first = 0;
  std::uint16_t count = 0, fragment_bytes = 0;
  std::uint32_t sample_bytes = 0;
};

constexpr std::uint16_t kLeastFragmentBytes = 1024;

/// Whether its numbers fit each other and the bytes that are there.
Refusal fragment_flaw(const Fragment& fragment, std::size_t bytes);

/// The samples of one writer that came in fragments. Fast DDS believes later fragments that they
/// are of the sample that the first one announced, and reads beyond their end if they are not: so
/// sizes are remembered for as long as it may hold the sample. Forgotten only from the oldest on,
/// and of what was forgotten no fragment is let through any more.
class FragmentTrack {
 public:
  static constexpr std::size_t kSamples = 4096, kOpen = 256;

  /// `bound`: the largest sample of the writer's topic. `complete`: set if its last missing
  /// fragment is likely to have come.
  Refusal add(const Fragment& fragment, std::uint32_t bound, bool& complete);
  [[nodiscard]] std::size_t size() const { return samples_.size(); }
  /// The writer has them no more.
  void forget_below(std::uint64_t first);
  /// Half of what is remembered.
  void forget_half();

 private:
  struct Sample {
    std::uint32_t bytes = 0, seen = 0;
    std::uint16_t fragment_bytes = 0;
    bool complete = false;
  };
  void forget_oldest();

  std::map<std::uint64_t, Sample> samples_;
  std::size_t open_ = 0;
  std::uint64_t forgotten_ = 0;  ///< highest number
  std::uint16_t fragment_bytes_ = 0;
};

}  // namespace crane::guard
