// SPDX-License-Identifier: Apache-2.0
// RTPS datagrams as the guard before Fast DDS sees them.
#include <cstdlib>
#include <vector>

#include "rtps_guard/guard.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crane::guard;
  static Guard guard;
  static Clock::time_point now{};
  now += std::chrono::milliseconds(1);
  Verdict verdict;
  guard.check({data, size}, 0x7F000001, now, verdict);
  if (verdict.refusal != Refusal::kNone || verdict.patches.empty()) return 0;
  // What was changed is sound, and needs no change but of numbers that go step by step.
  std::vector<std::uint8_t> patched(data, data + size);
  verdict.patches.apply(patched);
  Guard fresh;
  fresh.check(patched, 0x7F000001, now, verdict);
  if (verdict.refusal != Refusal::kNone) __builtin_trap();
  return 0;
}
