// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/pair_matcher.hpp"

#include <cstdlib>
#include <utility>

namespace crane {

HalfFrame PairMatcher::spare() {
  if (spare_.empty()) return {};
  HalfFrame out = std::move(spare_.back());
  spare_.pop_back();
  out.facts = {};
  return out;
}

void PairMatcher::give_back(HalfFrame used) {
  if (spare_.size() < 2 * kMostWaiting) spare_.push_back(std::move(used));
}

void PairMatcher::drop(int side, DropCounts& dropped) {
  dropped.add(Cause::kPairIncomplete);
  give_back(std::move(waiting_[side].front()));
  waiting_[side].pop_front();
}

PairMatcher::Verdict PairMatcher::judge(const FrameFacts& left, const FrameFacts& right) {
  const TimeNs apart = left.exposure_time - right.exposure_time;
  const bool together = std::abs(apart) <= rule_.within;
  const Verdict by_time = together    ? Verdict::kPair
                          : apart < 0 ? Verdict::kLeftAlone
                                      : Verdict::kRightAlone;
  if (rule_.by == PairRule::By::kTime) return by_time;
  const auto numbers = static_cast<std::int64_t>(left.number - right.number);
  if (!numbers_apart_) {
    if (together) numbers_apart_ = numbers;
    return by_time;
  }
  if (numbers != *numbers_apart_)
    return numbers < *numbers_apart_ ? Verdict::kLeftAlone : Verdict::kRightAlone;
  if (together) {
    refused_ = 0;
    return Verdict::kPair;
  }
  if (++refused_ >= kRelearn) {
    numbers_apart_.reset();
    refused_ = 0;
    ++relearned_;
  }
  return Verdict::kApart;
}

void PairMatcher::match(DropCounts& dropped) {
  auto& [left, right] = waiting_;
  while (!left.empty() && !right.empty()) {
    const Verdict verdict = judge(left.front().facts, right.front().facts);
    if (verdict == Verdict::kPair) {
      if (newest_) {
        dropped.add(Cause::kFrameOvertaken);
        give_back(std::move(newest_->left));
        give_back(std::move(newest_->right));
      }
      newest_ = Pair{std::move(left.front()), std::move(right.front())};
      left.pop_front();
      right.pop_front();
      continue;
    }
    if (verdict != Verdict::kRightAlone) drop(0, dropped);
    if (verdict != Verdict::kLeftAlone) drop(1, dropped);
  }
}

void PairMatcher::add(int side, HalfFrame frame, DropCounts& dropped) {
  std::deque<HalfFrame>& mine = waiting_[side];
  // Behind the one before: a clock was set. What waits is of the time before that.
  if (!mine.empty() && frame.facts.exposure_time <= mine.back().facts.exposure_time)
    for (const int each : {0, 1})
      while (!waiting_[each].empty()) drop(each, dropped);
  mine.push_back(std::move(frame));
  match(dropped);
  while (mine.size() > kMostWaiting) drop(side, dropped);
}

std::optional<PairMatcher::Pair> PairMatcher::take() {
  return std::exchange(newest_, std::nullopt);
}

}  // namespace crane
