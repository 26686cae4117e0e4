// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "motion/sweep_cells.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "motion/sweep_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void SweepOneCell(const SweepCell& cell, std::uint16_t* costs) {
  const hn::FixedTag<std::uint8_t, kSweepEdge> d;
  const hn::Repartition<std::uint64_t, decltype(d)> d64;
  for (int i = 0; i < cell.count; ++i) {
    if (cell.offsets[i] < 0) {
      costs[i] = kNotVisible;
      continue;
    }
    const std::uint8_t* a = cell.here;
    const std::uint8_t* b = cell.there + cell.offsets[i];
    auto even = hn::Zero(d64);
    auto odd = hn::Zero(d64);
    for (int row = 0; row < kSweepEdge; row += 2) {
      const auto a0 = hn::LoadU(d, a);
      const auto b0 = hn::LoadU(d, b);
      const auto a1 = hn::LoadU(d, a + cell.here_stride);
      const auto b1 = hn::LoadU(d, b + cell.there_stride);
      even = hn::Add(even, hn::SumsOf8(hn::Or(hn::SaturatedSub(a0, b0), hn::SaturatedSub(b0, a0))));
      odd = hn::Add(odd, hn::SumsOf8(hn::Or(hn::SaturatedSub(a1, b1), hn::SaturatedSub(b1, a1))));
      a += 2 * cell.here_stride;
      b += 2 * cell.there_stride;
    }
    costs[i] = static_cast<std::uint16_t>(hn::GetLane(hn::SumOfLanes(d64, hn::Add(even, odd))) / 2);
  }
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(SweepOneCell);

void sweep_cell(const SweepCell& cell, std::uint16_t* costs) {
  HWY_DYNAMIC_DISPATCH(SweepOneCell)(cell, costs);
}

void sweep_cell_slow(const SweepCell& cell, std::uint16_t* costs) {
  for (int i = 0; i < cell.count; ++i) {
    if (cell.offsets[i] < 0) {
      costs[i] = kNotVisible;
      continue;
    }
    int sum = 0;
    for (int y = 0; y < kSweepEdge; ++y)
      for (int x = 0; x < kSweepEdge; ++x) {
        const int difference = cell.here[y * cell.here_stride + x] -
                               cell.there[cell.offsets[i] + y * cell.there_stride + x];
        sum += difference < 0 ? -difference : difference;
      }
    costs[i] = static_cast<std::uint16_t>(sum / 2);
  }
}

}  // namespace crane
#endif
