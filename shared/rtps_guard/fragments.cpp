// SPDX-License-Identifier: Apache-2.0
#include "rtps_guard/fragments.hpp"

#include <algorithm>

namespace crane::guard {

Refusal fragment_flaw(const Fragment& f, std::size_t bytes) {
  if (f.first == 0 || f.count == 0 || f.fragment_bytes < kLeastFragmentBytes)
    return Refusal::kFragment;
  const std::uint64_t size = f.fragment_bytes;
  const std::uint64_t begin = (std::uint64_t{f.first} - 1) * size;
  if (begin + (std::uint64_t{f.count} - 1) * size >= f.sample_bytes) return Refusal::kFragment;
  // Fast DDS writes a number of 4 bytes into what it waits for, also at the sample's end: into what
  // malloc gives in addition, or beyond.
  const std::uint64_t tail = (std::uint64_t{f.sample_bytes} - 1) / size * size;
  if ((tail + 3) / 4 * 4 + 4 > (std::uint64_t{f.sample_bytes} + 7) / 8 * 8)
    return Refusal::kFragment;
  const std::uint64_t end = std::min<std::uint64_t>(begin + f.count * size, f.sample_bytes);
  return bytes < end - begin ? Refusal::kFragment : Refusal::kNone;
}

Refusal FragmentTrack::add(const Fragment& f, std::uint32_t bound, bool& complete) {
  if (f.sample_bytes > bound) return Refusal::kSampleSize;
  auto known = samples_.find(f.sample);
  if (known == samples_.end()) {
    if (f.sample <= forgotten_) return Refusal::kFragmentsDisagree;
    // A writer that changes the size of its fragments starts anew; what is open keeps its own.
    if (fragment_bytes_ != f.fragment_bytes && open_ > 0) return Refusal::kFragmentsDisagree;
    fragment_bytes_ = f.fragment_bytes;
    known = samples_.emplace(f.sample, Sample{f.sample_bytes, 0, f.fragment_bytes}).first;
    ++open_;
  }
  Sample& sample = known->second;
  if (sample.fragment_bytes != f.fragment_bytes || sample.bytes != f.sample_bytes)
    return Refusal::kFragmentsDisagree;
  if (!sample.complete) {
    sample.seen += f.count;
    const std::uint32_t all = (f.sample_bytes - 1) / f.fragment_bytes + 1;
    sample.complete = sample.seen >= all;
    if (sample.complete) --open_;
    complete = sample.complete;
  }
  while (samples_.size() > kSamples || open_ > kOpen) forget_oldest();
  return Refusal::kNone;
}

void FragmentTrack::forget_oldest() {
  const auto oldest = samples_.begin();
  forgotten_ = oldest->first;
  if (!oldest->second.complete) --open_;
  samples_.erase(oldest);
}

void FragmentTrack::forget_below(std::uint64_t first) {
  while (!samples_.empty() && samples_.begin()->first < first) forget_oldest();
}

void FragmentTrack::forget_half() {
  for (std::size_t n = samples_.size() / 2; n > 0; --n) forget_oldest();
}

}  // namespace crane::guard
