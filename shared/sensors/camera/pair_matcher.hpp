// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "sensors/camera/frame_source.hpp"

namespace crane {

/// One image of one of two cameras.
struct HalfFrame {
  std::vector<std::uint8_t> image;
  FrameFacts facts;
};

/// When two images are of one exposure.
struct PairRule {
  enum class By { kTime, kNumber };
  By by = By::kTime;
  /// Their times differ by no more [ns]. By time: less than half a period, or the wrong ones meet;
  /// by number: less than a period.
  TimeNs within = 0;
};

/// Brings the images of two cameras together, by their times or by the number of their trigger. The
/// newest pair wins; images wait in order, at most kMostWaiting a side, and one whose other did not
/// come is counted and given up.
///
/// Two cameras hardly ever count from the same trigger: how far their numbers are apart is taken
/// from the first images whose times fit. A camera that misses a trigger is then one off for ever:
/// images that fit by number but not by time are refused, and after kRelearn of them it is found
/// out anew. One thread.
class PairMatcher {
 public:
  struct Pair {
    HalfFrame left, right;
  };
  explicit PairMatcher(PairRule rule) : rule_(rule) {}

  /// `side` 0 left, 1 right.
  void add(int side, HalfFrame frame, DropCounts& dropped);
  /// The newest pair since the last call.
  std::optional<Pair> take();
  /// Memory for the next image; `used` is what take() gave, or a spare one.
  HalfFrame spare();
  void give_back(HalfFrame used);
  /// Images of this side that wait for their other.
  [[nodiscard]] std::size_t waiting(int side) const { return waiting_[side].size(); }
  /// How often the numbers had to be brought together again.
  [[nodiscard]] std::uint64_t relearned() const { return relearned_; }

  static constexpr std::size_t kMostWaiting = 4;
  static constexpr int kRelearn = 3;

 private:
  enum class Verdict { kPair, kLeftAlone, kRightAlone, kApart };
  Verdict judge(const FrameFacts& left, const FrameFacts& right);
  void match(DropCounts& dropped);
  void drop(int side, DropCounts& dropped);

  PairRule rule_;
  std::deque<HalfFrame> waiting_[2];
  std::optional<Pair> newest_;
  std::vector<HalfFrame> spare_;
  std::optional<std::int64_t> numbers_apart_;  ///< left minus right
  int refused_ = 0;                            ///< in a row, by their times
  std::uint64_t relearned_ = 0;
};

}  // namespace crane
